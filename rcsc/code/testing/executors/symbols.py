"""What the emitted executors call things, read from the symbol file that is emitted beside them.

In: the text of `<program>.json`. Out: names of files, functions and leaves, in C and in Python.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcsc.base.host.files.read import json_of
from rcsc.lang.model import I64_MAX, Bool, Int, Program, Real, Scalar, Single


@dataclass(frozen=True, slots=True)
class LeafSymbol:
    """A leaf in the executors.

    Attributes:
        path: Its place in the C struct, `emove_status.echo`.
        c_type: Its C type, `uint8_t`.
        attribute: Its attribute in the Python class.
    """

    path: str
    c_type: str
    attribute: str


@dataclass(frozen=True, slots=True)
class Symbols:
    """Every name that the suite uses.

    Attributes:
        leaves: By name of the leaf, in declared order.
        lines: By table: function that says which line matches.
        steps: By table: function of one step.
        batches: By table: function for many inputs.
        cycles: By level: function of one cycle.
        module: File name of the Python executor.
        state_class: Its class.
        check: Function that says whether a state may be gone on from.
        digest: What a state of these tables has as its `digest`.
        failed: Members of the struct with a bit for each assumption that is checked and failed, 64 in each.
    """

    program: str
    struct: str
    header: str
    source: str
    init: str
    leaves: Mapping[str, LeafSymbol]
    lines: Mapping[str, str]
    steps: Mapping[str, str]
    batches: Mapping[str, str]
    cycles: Mapping[str, str]
    module: str
    state_class: str
    check: str
    digest: int
    failed: tuple[str, ...]

    def path(self, name: str) -> str:
        """Place of a leaf in the struct."""
        return self.leaves[name].path

    def c_type(self, name: str) -> str:
        """C type of a leaf."""
        return self.leaves[name].c_type

    def fault_at(self, name: str) -> int:
        """What `fault_at` says when this leaf is refused."""
        return list(self.leaves).index(name)

    def value_type(self, kind: Scalar) -> str:
        """C type of a parameter of this kind."""
        if isinstance(kind, Single):
            return "float"
        if isinstance(kind, Bool | Real):
            return "bool" if isinstance(kind, Bool) else "double"
        wide = isinstance(kind, Int) and kind.low >= 0 and kind.high > I64_MAX
        return "uint64_t" if wide else "int64_t"

    def leaf_at(self, number: int) -> str:
        """The leaf that `fault_at` means."""
        return dict(enumerate(self.leaves)).get(number, f"leaf {number}")

    def failed_bit(self, who: str, number: int) -> str:
        """C of whether monitored assumption `number` failed; `who` is a C expression of the struct."""
        return f"((({who}.{self.failed[number // 64]}) >> {number % 64}) & 1u)"


def symbols_of(program: Program, files: Mapping[str, str]) -> Symbols:
    """The names in the symbol file of a program.

    Args:
        program: The program.
        files: Its generated files, text by path.

    Raises:
        KeyError: The symbol file is missing, or is another program's.
    """
    documents = [json_of(text) for path, text in files.items() if path.endswith(".json")]
    names = [str(v.name) for v in program.variables]
    for document in documents:
        if [leaf["name"] for leaf in document["leaves"]] == names:
            return _symbols(document)
    raise KeyError(program.name)


def text_of(name: str, files: Mapping[str, str]) -> str:
    """Return the text of the file of this name; files by path."""
    return next(text for path, text in files.items() if Path(path).name == name)


def _symbols(document: Mapping[str, Any]) -> Symbols:
    leaves = {x["name"]: LeafSymbol(x["path"], x["c_type"], x["attribute"]) for x in document["leaves"]}
    tables = document["tables"]
    return Symbols(
        program=document["program"],
        struct=document["struct"],
        header=document["header"],
        source=document["source"],
        init=document["init"],
        leaves=leaves,
        lines={x["name"]: x["line"] for x in tables},
        steps={x["name"]: x["step"] for x in tables},
        batches={x["name"]: x["lines_of_many"] for x in tables},
        cycles={x["name"]: x["cycle"] for x in document["levels"]},
        module=document["python"]["module"],
        state_class=document["python"]["class"],
        check=document["check"],
        digest=document["digest"]["state"],
        failed=tuple(document.get("failed", ("assumptions_failed",))),
    )
