"""What claims take for granted, for which no level is responsible: each kind with the sentence that `rcsc prove` prints of it.

In: a sentence. Out: which kind of trust it is, and of whom. One table, so that what watches a claim can tell when its trust is broken.
"""

import re
from enum import Enum


class Trust(Enum):
    """A kind of trust, with its sentence; LEVEL, NAME, INPUTS and ARE stand for whom and what it is about."""

    DECLARED = "assumption `NAME` of level `LEVEL`, as it is declared"
    STATES = "level `LEVEL` can be as its tables declare in every state that it comes to"
    DATABASE = "the same question has the same answer in `NAME` of level `LEVEL`"
    PROTOCOL = "`LEVEL` keeps to the protocol"
    REFUSED = "INPUTS of level `LEVEL` ARE never refused"
    CLAMPED = "INPUTS of level `LEVEL` ARE in range where it begins anew"
    NOT_FOR_EVER = "INPUTS of level `LEVEL` ARE not refused for ever"
    RESTS = "`LEVEL` comes to rest some time where it is told to, and stays so"
    ANSWERS = "`LEVEL` answers every order that is not replaced, and stays so"
    STILL = "the values in `NAME` of level `LEVEL` stand still meanwhile"
    EXTERNS_FINITE = "extern procedures of level `LEVEL` are not refused for ever"


_PLACES = {
    "LEVEL": "(?P<level>[^`]+)",
    "NAME": "(?P<name>[^`]+)",
    "INPUTS": "`[^`]+`(?:, `[^`]+`)*",
    "ARE": "(?:is|are)",
}
_PATTERNS = {
    trust: re.compile(re.sub("|".join(_PLACES), lambda found: _PLACES[found[0]], re.escape(trust.value)))
    for trust in Trust
}


def trust_of(words: str) -> tuple[str, str, str]:
    """Return a trust's kind, its level or neighbour, and its name; empty where it has none, all empty for a sentence of no kind."""
    for trust, pattern in _PATTERNS.items():
        if (found := pattern.fullmatch(words)) is not None:
            parts = found.groupdict()
            return trust.name, parts.get("level") or "", parts.get("name") or ""
    return "", "", ""
