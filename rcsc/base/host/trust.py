"""Whether the code of a folder may run: its user agrees to that once a folder, as with the workspaces of an editor.

In: a folder. Out: whether it was agreed to. Opening a folder (`rcsc studio`) runs none of its code before: no plant and what a plant loads,
a MuJoCo model among it, no extern procedure, no generated executor. A command that says what runs is itself the agreement (`rcsc run`).

An agreement is kept in the user's own state folder, under the real path of the project, and names the folder itself: one that is put in its
place is another. It is not bound to the files in it, which the user edits; whoever may write into the folder is trusted with it.
"""

import hashlib
import json
import os
from dataclasses import dataclass, field
from pathlib import Path

from rcsc.base.host.files import write_atomically
from rcsc.base.host.files.read import CheckedFields, Malformed, content, json_of

_MOST = 64 * 1024


def state_folder() -> Path:
    """Return where rcsc keeps what a user did, from one session to the next.

    Source: XDG Base Directory Specification 0.8, `XDG_STATE_HOME`.
    """
    return Path(os.environ.get("XDG_STATE_HOME") or "~/.local/state").expanduser() / "rcsc"


@dataclass(slots=True)
class Agreement:
    """Whether the code of one folder may run.

    Attributes:
        folder: Of a project; its real path is what is agreed to.
        given: Whether it is agreed to; what was kept is looked up once.
    """

    folder: Path
    given: bool = False
    _known: object = field(init=False, default=None)

    def __post_init__(self) -> None:
        """Looks up what was kept."""
        self.folder = Path(os.path.realpath(self.folder))
        self._known = _about(self.folder)
        self.given = self.given or (self._known is not None and _kept(_place(self.folder)) == self._known)

    def give(self) -> None:
        """Agree, from now on; where that cannot be kept, or the folder is another than was opened, for this session."""
        self.given = True
        if self._known is None or _about(self.folder) != self._known:
            return
        place = _place(self.folder)
        try:
            place.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            write_atomically(place, json.dumps(self._known).encode() + b"\n", 0o600)
        except OSError:
            return


def _place(folder: Path) -> Path:
    named = hashlib.sha256(os.fsencode(folder)).hexdigest()[:32]
    return state_folder() / "trusted" / f"{named}.json"


def _about(folder: Path) -> dict[str, object] | None:
    """Return which folder it is; None where there is none."""
    try:
        stat = folder.stat()
    except OSError:
        return None
    return {
        "folder": os.fsencode(folder).decode(errors="backslashreplace"),
        "inode": stat.st_ino,
        "owner": stat.st_uid,
    }


def _kept(place: Path) -> dict[str, object] | None:
    """Return which folder was agreed to; None where nothing was, or another user wrote it."""
    try:
        if place.lstat().st_uid != os.getuid():
            return None
        kept = CheckedFields(json_of(content(place, _MOST), plain=False))
    except (OSError, Malformed):
        return None
    return dict(kept.value)
