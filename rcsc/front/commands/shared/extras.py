"""What the core leaves out: the packages of each extra, and the one place that says which extra to install.

`pip install rcsc` brings what check, compile, fmt, prove, certify, diff and the hooks import. Everything else imports
its packages where they are used, and a package that is not there is the coded error RCS705.
"""

from collections.abc import Mapping
from importlib.util import find_spec

from rcsc.base.diagnostics.codes import Code
from rcsc.front.commands.shared.stopped import Stopped

EXTRAS: Mapping[str, tuple[str, ...]] = {
    "log": ("mcap", "zstandard"),
    "cell": ("mujoco", "mcap", "zstandard"),
    "certify": ("cvc5",),
    "cluster": ("distributed",),
    "hypothesis": ("hypothesis",),
    "lsp": ("pygls", "lsprotocol"),
    "parquet": ("pyarrow",),
    "plot": ("matplotlib",),
    "studio": ("aiohttp", "mcap", "zstandard"),
    "video": ("av", "PIL", "mujoco", "mcap", "zstandard"),
}
"""What each extra of `pyproject.toml` makes importable; of two with one package the smaller comes first.

The extras `graph` and `shell` are not here: without them another layout program, or a plain prompt, does.
"""


def need(extra: str) -> None:
    """Stop a command before its work, if that would end at a missing package.

    Raises:
        Stopped: A package of the extra is not installed.
    """
    for package in EXTRAS[extra]:
        if find_spec(package) is None:
            raise _missing(package, extra)


def _missing(package: str, extra: str) -> Stopped:
    return Stopped(Code.EXTRA_MISSING, f"`{package}` is not installed", f"pip install 'rcsc[{extra}]'")


def lacking(error: ModuleNotFoundError) -> Stopped | None:
    """Return the stop that names the extra to install, where an import misses one of its packages; else None."""
    package = (error.name or "").partition(".")[0]
    extra = next((name for name, packages in EXTRAS.items() if package in packages), None)
    return None if extra is None else _missing(package, extra)
