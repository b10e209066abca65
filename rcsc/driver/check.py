"""`rcsc check`: every table proved, and what is known of the levels together; an unchanged project is recognised without being parsed."""

import os
from pathlib import Path

from rcsc.diagnostics.report import Report
from rcsc.driver.settings import Settings
from rcsc.driver.unchanged import recall, remember
from rcsc.host.cache import Cache, open_cache
from rcsc.lang.project import project_root, systems_above


def check(settings: Settings) -> Report:
    """Prove every table; of those that a system's levels run, say what is known of the levels together."""
    cache = _cache(settings)
    report = _checked(settings, cache)
    if cache is None or not any(systems_above(table.file) for table in report.tables):
        return report
    from rcsc.driver.together import with_levels  # keep lazy: most files belong to no system

    return with_levels(report, cache)


def _checked(settings: Settings, cache: Cache | None) -> Report:
    """Every table by itself; an unchanged project is recognised without being parsed."""
    whole = None if settings.stdin is not None else cache
    known = recall(whole, settings.paths, settings.options) if whole else None
    if known is not None:
        return known
    from rcsc.driver.pipeline import (
        proved,  # keep lazy: parser and provers, which nobody needs where nothing has changed
    )

    project = proved(settings, cache)
    report = project.report()
    if whole is not None:
        remember(whole, settings.paths, settings.options, project.loaded, report)
    return report


def _cache(settings: Settings) -> Cache | None:
    if not settings.use_cache:
        return None
    first = settings.paths[0]
    inside = os.path.join(first, "-") if os.path.isdir(first) else first
    return open_cache(Path(project_root(inside)))
