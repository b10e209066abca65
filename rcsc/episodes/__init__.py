"""Episodes: one run of a system with whatever is odd about it, and what became of it.

An *episode* is a value: orders, and what goes wrong while they are under way. Run, it has an *outcome*: how each order
ended, which properties did not hold and in which cycle, which lines ran, and a digest of every value of every cycle, by
which two runs are told to be the same:

>>> from rcsc.episodes.outcome import EpisodeFinding, EpisodeOutcome
>>> bumped = EpisodeFinding("rests when it is charged", 12, "drive.speed_mm_s = 400")
>>> EpisodeOutcome((), (bumped,), "done", 80, frozenset(), "").findings[0].tick
12

Nothing here is trusted for a proof. What it costs: the run.

Modules: `outcome` (what became of an episode).
"""
