"""The kinds of evidence, by the names that `rcsc evidence --only` takes."""

from collections.abc import Mapping
from types import MappingProxyType

from rcsc.views.evidence import analysers, coverage, model_check, resources, runtime
from rcsc.views.evidence.kind import Kind
from rcsc.views.evidence.misra import compliance

KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "coverage": coverage.KIND,
        "runtime": runtime.KIND,
        "analysers": analysers.KIND,
        "model-check": model_check.KIND,
        "resources": resources.KIND,
        "misra": compliance.KIND,
    }
)
"""In the order in which they are made and listed. A new one is a module and its line here."""
