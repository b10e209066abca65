"""Files that show what is shared: a moment, or a finding; and the part that a run's report has of the studio.

In: what is shown, as the pages of the studio have it. Out: the text of one HTML file; the same for the same. A file has one script, made
of the modules of the studio's page that a file has use for.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from markupsafe import Markup

from rcsc.views.pages.frame import environment, hashed, packed

PARTS = (
    "make.js", "bus.js", "keys.js", "moments.js", "exchanges.js", "level.js", "film.js", "controls.js", "playing.js", "timeline.js",
    "vendor/uplot/uPlot.js", "plots.js", "player.js",
)  # fmt: skip
"""Modules of the studio's page of which a file's script is made; each takes from those before it alone."""
STYLES = ("vendor/uplot/uPlot.css", "parts.css")
_IMPORT = re.compile(r'^import (.+) from "(.+)";\n', re.MULTILINE)
_AGAIN = re.compile(r'^export (\{.+\}) from "(.+)";\n', re.MULTILINE)
_NAMED = re.compile(r"^export ((?:async )?(?:function|class|const) (\w+))", re.MULTILINE)
_LISTED = re.compile(r"^export \{(.+)\};\n?", re.MULTILINE)
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_BESIDE = re.compile(r"[^\w]")


def bundled(parts: Sequence[tuple[str, str]]) -> str:
    """Return one script of modules: each is a function of its own, so that none sees the private names of another.

    Args:
        parts: Path and text of each, in an order in which each takes from those before it alone.
    """
    every = "\n".join(
        f"const {_called(path)} = await (async () => {{\n{_module(text)}}})();" for path, text in parts
    )
    return f'"use strict";\n(async () => {{\n{every}\n}})();\n'


def _module(text: str) -> str:
    """Return the body of a module's function, which returns its exports."""
    gives: dict[str, str] = {name: name for _, name in _NAMED.findall(_COMMENT.sub("", text))}
    gives |= {name: name for names, _ in _AGAIN.findall(text) for name, _ in _listed(names)}
    gives |= {given: name for names in _LISTED.findall(text) for name, given in _listed(names)}
    text = _AGAIN.sub(lambda found: f"const {found[1]} = {_called(found[2])};\n", text)
    text = _LISTED.sub("", _NAMED.sub(r"\1", text))
    taken = _IMPORT.sub(lambda found: f"const {_taken(found[1])} = {_called(found[2])};\n", text)
    return f"{taken}\nreturn {{ {', '.join(f'{given}: {name}' for given, name in gives.items())} }};\n"


def _taken(names: str) -> str:
    """Return the imported names as a pattern."""
    if not names.startswith("{"):
        return f"{{ default: {names} }}"
    return "{" + ", ".join(f"{name}: {here}" for name, here in _listed(names)) + "}"


def _listed(names: str) -> Iterator[tuple[str, str]]:
    """Yield each name of a list, and the name that it gets."""
    for each in names.strip("{} ").split(","):
        name, _, called = each.strip().partition(" as ")
        yield name, called or name


def _called(path: str) -> str:
    return "m_" + _BESIDE.sub("_", path.rpartition("/")[2])


@cache
def player() -> str:
    """Return the script of a film."""
    page = files("rcsc.desk.studio").joinpath("page")
    return bundled([(part, page.joinpath(part).read_text(encoding="utf-8")) for part in PARTS])


@cache
def style() -> str:
    """Return the style of its parts."""
    page = files("rcsc.desk.studio").joinpath("page")
    return "\n".join(page.joinpath(part).read_text(encoding="utf-8") for part in STYLES)


@dataclass(frozen=True, slots=True)
class Played:
    """The parts of a page that show a film; `played.html.jinja` of `rcsc.views.pages` places them.

    Attributes:
        data: The film, packed.
        script: That draws it.
        hash: As the policy names the script.
        style: Of its parts.
    """

    data: Markup
    script: Markup
    hash: str
    style: Markup


def played(film: dict[str, Any]) -> Played:
    """Make a film part of a page."""
    code = Markup(player())  # noqa: S704  # the project's own
    return Played(packed(film), code, hashed(code), Markup(style()))  # noqa: S704  # likewise


def of_film(title: str, film: dict[str, Any]) -> str:
    """Return the file of a moment and the ticks around it.

    Args:
        title: Whose run it is.
        film: As `film` has it.
    """
    return _TEMPLATES.get_template("moment.html.jinja").render(title=title, film=film, played=played(film))


def of_finding(
    title: str, table: dict[str, Any] | None, finding: dict[str, Any], repairs: Sequence[dict[str, Any]]
) -> str:
    """Return the file of a finding.

    Args:
        title: Whose table it is.
        table: As the grid has it; None where the finding is of none.
        finding: Likewise.
        repairs: That were checked.
    """
    shown = finding["witnesses"][0] if finding["witnesses"] else None
    return _TEMPLATES.get_template("finding.html.jinja").render(
        title=title, table=table, finding=finding, repairs=repairs, witness=shown
    )


_TEMPLATES = environment("rcsc.desk.studio", "share")
