"""Coverage that an earlier run made, in the cache under all that it depends on; its places hold while the texts are as they were."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from rcsc.base.diagnostics.source import Source
from rcsc.base.host.cache import Cache
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.coverage.covered import Coverage, covered
from rcsc.compose.proof.candidates import content
from rcsc.compose.proof.level import LevelProof
from rcsc.lang.project import Loaded
from rcsc.proof.solvers import smt


@dataclass(frozen=True, slots=True)
class _Kept:
    """Coverage, and the digest of each text that its places are in, by name."""

    coverage: Coverage
    texts: dict[str, str]


def recalled(cache: Cache, level: str) -> Coverage | None:
    """Return what is kept of a level, by the digest of its content; its places may be of other texts."""
    kept = cache.load(_Kept, "coverage", level)
    return None if kept is None else kept.coverage


def made(cache: Cache | None, ts: TransitionSystem, proof: LevelProof, loaded: Loaded) -> Coverage:
    """Return the coverage of a level, and keep it."""
    texts, level = _digests(loaded.sources), content(ts)
    kept = None if cache is None else cache.load(_Kept, "coverage", level)
    if kept is not None and kept.texts == texts:
        return kept.coverage
    cut_before = smt.cut_short()
    found = covered(ts, proof, loaded)
    if cache is not None and smt.cut_short() == cut_before:  # else another machine might find something else
        cache.store(_Kept(found, texts), "coverage", level)
    return found


def _digests(sources: Mapping[str, Source]) -> dict[str, str]:
    return {name: hashlib.sha256(source.text.encode()).hexdigest() for name, source in sources.items()}
