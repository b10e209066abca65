"""Diagnostics and reports as JSON values; `schema/report.schema.json` is the contract.

Offsets count characters from 0; lines and columns count from 1.
"""

from dataclasses import asdict
from typing import Any

from rcsc import __version__
from rcsc.base.diagnostics.diagnostic import Diagnostic, Effects, Label, Severity, WitnessColumn
from rcsc.base.diagnostics.report import InSystem, Report, SystemReport, TableReport
from rcsc.base.diagnostics.source import Source, Sources, Span

FORM = 1
"""Version of this form; it rises when a member changes its meaning or goes away."""

Json = dict[str, Any]


def report_to_json(report: Report, command: str) -> Json:
    """Return the whole outcome of `command`.

    Raises:
        ValueError: A value cannot be written as JSON (not for any that rcsc makes).
    """
    return {
        "form": FORM,
        "tool": {"name": "rcsc", "version": __version__},
        "command": command,
        "ok": not report.failed,
        "counts": {f"{severity.value}s": report.count(severity) for severity in Severity},
        "diagnostics": [diagnostic_to_json(diagnostic, report.sources) for diagnostic in report.diagnostics],
        "tables": [table_to_json(table) for table in report.tables],
        "systems": [_listed(system) for system in report.systems],
        "published": {
            "files": list(report.published),
            "counts": {f"{each.value}s": report.count(each, published=True) for each in Severity},
        },
    }


def table_to_json(table: TableReport) -> Json:
    """Return a table's verdict and its backing."""
    return {
        "table": table.table,
        "file": table.file,
        "verdict": table.verdict.value,
        "lines": table.lines,
        "method": table.method,
        "decided_by": table.decided_by,
        "confirmed_by_z3": table.confirmed_by_z3,
        "confirmed_by": table.confirmed_by,
        "assumptions": [{"name": name, "standing": standing} for name, standing in table.assumptions],
        "proof_ms": round(table.proof_ms, 3),
        "cached": table.cached,
        "together": None if table.together is None else _listed(table.together),
        "stops": list(table.stops),
        "tells": list(table.tells),
    }


def _listed(known: InSystem | SystemReport | Effects) -> Json:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(known).items()}


def diagnostic_to_json(diagnostic: Diagnostic, sources: Sources) -> Json:
    """Return one diagnostic, with its places as offsets and as lines and columns."""
    return {
        "code": diagnostic.code.value,
        "severity": diagnostic.severity.value,
        "message": diagnostic.message,
        "primary": _label_to_json(diagnostic.primary, sources),
        "related": [_label_to_json(label, sources) for label in diagnostic.related],
        "notes": list(diagnostic.notes),
        "help": list(diagnostic.help),
        "witnesses": [_witness_to_json(witness, sources) for witness in diagnostic.witnesses],
        "more": diagnostic.more,
        "effects": None if diagnostic.effects is None else _listed(diagnostic.effects),
    }


def _label_to_json(label: Label, sources: Sources) -> Json:
    return {"place": _span_to_json(label.span, sources), "message": label.message}


def _span_to_json(span: Span, sources: Sources) -> Json:
    source = sources.get(span.file, Source(span.file, ""))
    return {
        "file": span.file,
        "start": _position_to_json(source, span.start),
        "end": _position_to_json(source, span.end),
    }


def _position_to_json(source: Source, offset: int) -> Json:
    position = source.position(offset) if offset <= len(source.text) else source.position(0)
    return {"offset": offset, "line": position.line, "column": position.column}


def _witness_to_json(witness: WitnessColumn, sources: Sources) -> Json:
    values = zip(witness.variables, witness.values, strict=True)
    return {
        "table": witness.table,
        "input": [{"variable": variable, "value": value} for variable, value in values],
        "lines": [
            {
                "name": line.name,
                "cells": list(line.cells),
                "place": None if line.span is None else _span_to_json(line.span, sources),
            }
            for line in witness.lines
        ],
        "region": list(witness.region),
        "inputs": witness.inputs,
        "effects": None if witness.effects is None else _listed(witness.effects),
    }
