"""Neovim itself, without a window: findings, a proved repair, the keys in a table and what the lenses do.

    python -m tests.clients.nvim

In: Debian's neovim (0.7.2 or later), and `rcsc` beside this Python. Out: nothing, or why not. It is no test of `pytest`.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.clients.vscode import DOOR, EXTENSION

STORY = Path(__file__).with_name("story.lua")
WAITS_S = 300


def main() -> int:
    nvim = shutil.which("nvim")
    assert nvim, "Neovim is needed (Debian's package `neovim`)"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "lua").mkdir()
        shutil.copy(EXTENSION.parent / "nvim" / "rcsc.lua", folder / "lua")
        (folder / "door.rcs").write_text(DOOR, encoding="utf-8")
        begin = f"set rtp^={folder} | let g:rcsc = '{Path(sys.executable).with_name('rcsc')}' | let mapleader = ' '"
        command: list[str | Path] = [
            nvim, "--headless", "-u", "NONE", "-i", "NONE", "--cmd", begin, "-c", f"luafile {STORY}",
            folder / "door.rcs",
        ]  # fmt: skip
        ran = subprocess.run(command, capture_output=True, text=True, timeout=WAITS_S, check=False)
        said = (ran.stdout + ran.stderr).replace("\r", "")
        assert ran.returncode == 0, said
        assert said.rstrip().endswith("all of it is as it should be"), said
        print(said.strip().splitlines()[-1])
    return 0


if __name__ == "__main__":
    sys.exit(main())
