"""The hazard of the published listing is there, as the README says; that the shipped one has none is in `test_system`."""

from tests.published import empty_buffer


def test_the_pending_state_overwrites_the_failure() -> None:
    cycles = empty_buffer()
    assert (cycles[0].line, cycles[0].cur_state, cycles[0].pending) == ("7", "f_state", "state_5")
    assert cycles[1].status_report == "failed"
    assert "executing" in {cycle.status_report for cycle in cycles[2:]}, "the failure stays reported"
    assert cycles[-1].failure == "state", "the reason is lost"
