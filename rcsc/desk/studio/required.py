"""The requirements of a system as they stand: what its levels state, and what is stated across them.

In: the question `required.list`. Out: each with its verdict as `rcsc prove` found it last, what that trusts, and a log whose run breaks it.
Nothing is proved for it, and nothing runs.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rcsc.base.diagnostics.coded import CodedError, Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.cache import open_cache
from rcsc.desk.studio.build import FOUND, NO_SYSTEM
from rcsc.desk.studio.hub import PROVER, Ask, Concern, Json
from rcsc.desk.studio.runs.logs import Logs, glance
from rcsc.driver.requirements import KnownRequirement, known_requirements, read
from rcsc.run.episodes.across import ACROSS


@dataclass(frozen=True, slots=True)
class _Run:
    """A log that is kept for a finding."""

    name: str
    path: Path
    text: str


class Required(Concern):
    """Lists requirements."""

    name, lane = "required", "required"

    def __init__(self, path: Path, logs: Logs) -> None:
        """Args: path: Of the description; logs: That pages may open."""
        self._path, self._logs = path, logs

    def _on_list(self, ask: Ask) -> Json:
        """Return every requirement with its standing; those across levels first."""
        if not self._path.is_file():
            raise Refused(Code.STUDIO, NO_SYSTEM)
        try:
            with PROVER:
                cache = open_cache(self._path.parent)
                every = tuple(known_requirements(read(self._path, cache), cache))
        except CodedError as error:
            raise Refused(Code.STUDIO, str(error)) from error
        ask.check()
        runs = [_Run(name, path, text) for name, path in self._logs.newest() if (text := glance(path))]
        return [_shown(one, next(_broken_by(one, runs), "")) for one in every]


def _broken_by(one: KnownRequirement, runs: list[_Run]) -> Iterator[str]:
    """Yield the logs whose run breaks a requirement that is not proved: those of a proof, then those of campaigns."""
    name = one.stated.name
    if one.state in {"proved", "conditional"}:
        return
    stem = f"{one.level}_{one.stated.word}_{name}" if one.level else name
    of_proof = (run for run in runs if run.path.parent.parts[-2:] == FOUND.parts and run.path.stem == stem)
    yield from (run.name for run in of_proof if run.text == f"{one.stated.word} `{name}`")
    word = f"assumption {name}" if one.stated.assumed else name
    yield from (run.name for run in runs if run.text.startswith(f"`{one.level or ACROSS}: {word}` "))


def _shown(one: KnownRequirement, log: str) -> Json:
    return {
        "level": one.level, "name": one.stated.name, "word": one.stated.word, "text": one.stated.text, "doc": one.stated.doc,
        "place": one.place, "req": list(one.stated.requirements), "monitored": one.stated.monitored,
        "state": one.state, "words": one.words, "timing": one.timing, "levels": list(one.levels), "trusts": list(one.trusts),
        "log": log,
    }  # fmt: skip
