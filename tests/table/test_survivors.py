"""The reasons for mutants that survive speak of the code as it is: one that is out of date excuses nothing, and nobody would see."""

import importlib
import inspect
import tomllib
from typing import Any

import pytest

from tests.prover_mutants import MODULES, REASONS

SURVIVORS: list[dict[str, Any]] = tomllib.loads(REASONS.read_text(encoding="utf-8"))["survivor"]


@pytest.mark.parametrize("one", SURVIVORS, ids=[one["function"] for one in SURVIVORS])
def test_a_reason_is_about_lines_that_are_there(one: dict[str, Any]) -> None:
    module, _, name = one["function"].partition(":")
    assert {f"{module.replace('.', '/')}{end}" for end in (".py", "/__init__.py")} & set(MODULES)
    found: Any = importlib.import_module(module)
    for part in name.split("."):
        found = inspect.getattr_static(found, part)
    lines = {line.strip() for line in inspect.getsource(found).splitlines()}
    assert one["gone"]
    assert lines.issuperset(one["gone"])
    assert one["reason"].partition(":")[0] in {"equivalent", "search", "shown"}
