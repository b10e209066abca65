"""A short run of the fuzzer; the long one is `python -m tests.fuzz`."""

from tests.fuzz import campaign


def test_mutated_tables_and_garbage_give_only_coded_errors() -> None:
    count, _ = campaign(runs=600, seed=20261121)
    assert count["proved"] > 10, "the mutations are too wild to test anything past the parser"
    assert sum(number for code, number in count.items() if code.startswith("RCS2")) > 20
    # one in a hundred, give or take: which ones changes with every shipped table
    assert sum(number for code, number in count.items() if code.startswith("RCS4")) > 2
