"""The live page: what a run does, in a browser on the same machine, while it runs. Needs the extra `live`."""

from rcsc_cell.live.server import Live

__all__ = ["Live"]
