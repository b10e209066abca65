"""A report for services that show findings beside code: SARIF 2.1.0, and workflow commands of GitHub, shown as annotations.

Source: OASIS Standard "Static Analysis Results Interchange Format (SARIF) Version 2.1.0", 27 March 2020. GitHub documentation, "Workflow
commands for GitHub Actions"; the escapes are those of the runner's `ActionCommand` (`%`, CR and LF in data, and `:` and `,` too in
properties).
"""

import hashlib
from pathlib import PurePath
from typing import Any
from urllib.parse import quote

from rcsc import __version__
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.base.diagnostics.jsonform import table_to_json
from rcsc.base.diagnostics.printable import escape
from rcsc.base.diagnostics.render import region
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Source, Sources, Span

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"

Json = dict[str, Any]


def sarif(report: Report) -> Json:
    """Return one run with a result for each diagnostic; table verdicts are properties of the run."""
    codes = sorted({diagnostic.code for diagnostic in report.diagnostics})
    index = {code: number for number, code in enumerate(codes)}
    return {
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [
            {
                "tool": {
                    "driver": {
                        "name": "rcsc",
                        "version": __version__,
                        "semanticVersion": __version__,
                        "rules": [_rule(code) for code in codes],
                    }
                },
                "columnKind": "unicodeCodePoints",
                "results": [
                    _result(diagnostic, index[diagnostic.code], report.sources)
                    for diagnostic in report.diagnostics
                ],
                "properties": {"tables": [table_to_json(table) for table in report.tables]},
            }
        ],
    }


def _rule(code: Code) -> Json:
    explanation = code.explanation
    return {
        "id": code.value,
        "name": "".join(word.capitalize() for word in code.name.split("_")),
        "shortDescription": {"text": f"{explanation.title[0].upper()}{explanation.title[1:]}."},
        "fullDescription": {"text": explanation.text},
        "help": {"text": f"Run `rcsc explain {code.value}` for an example."},
    }


def _result(diagnostic: Diagnostic, rule: int, sources: Sources) -> Json:
    result: Json = {
        "ruleId": diagnostic.code.value,
        "ruleIndex": rule,
        "level": diagnostic.severity.value,
        "message": {"text": _message(diagnostic)},
        "partialFingerprints": {"rcscTableAndLine/v1": fingerprint(diagnostic)},
    }
    if diagnostic.primary.span.file:
        result["locations"] = [_location(diagnostic.primary, sources)]
    related = [label for label in diagnostic.related if label.span.file]
    if related:
        result["relatedLocations"] = [
            {"id": number, **_location(label, sources)} for number, label in enumerate(related, start=1)
        ]
    if diagnostic.witnesses:
        result["properties"] = {"witnesses": _witnesses(diagnostic), "more": diagnostic.more}
    return result


def fingerprint(diagnostic: Diagnostic) -> str:
    """Return a hash of code, file, table, lines and message, which added or realigned lines leave unchanged."""
    tables = [(witness.table, [line.name for line in witness.lines]) for witness in diagnostic.witnesses]
    stable = (diagnostic.code.value, diagnostic.primary.span.file, tables, diagnostic.message)
    return hashlib.sha256(repr(stable).encode()).hexdigest()[:32]


def _message(diagnostic: Diagnostic) -> str:
    lines = [f"{diagnostic.message[:1].upper()}{diagnostic.message[1:]}."]
    lines += [f"Note: {note}" for note in diagnostic.notes]
    lines += [f"Help: {text}" for text in diagnostic.help]
    return "\n".join(lines)


def _witnesses(diagnostic: Diagnostic) -> list[Json]:
    return [
        {
            "table": witness.table,
            "input": dict(zip(witness.variables, witness.values, strict=True)),
            "lines": [line.name for line in witness.lines],
            "region": region(witness),
        }
        for witness in diagnostic.witnesses
    ]


def _location(label: Label, sources: Sources) -> Json:
    location: Json = {
        "physicalLocation": {
            "artifactLocation": {"uri": uri(label.span.file)},
            "region": _region(label.span, sources.get(label.span.file)),
        }
    }
    if label.message:
        location["message"] = {"text": label.message}
    return location


def _region(span: Span, source: Source | None) -> Json:
    if source is None:
        return {"startLine": 1}
    start, end = source.position(span.start), source.position(max(span.start, span.end))
    return {
        "startLine": start.line,
        "startColumn": start.column,
        "endLine": end.line,
        "endColumn": end.column,
        "charOffset": span.start,
        "charLength": max(0, span.end - span.start),
    }


def uri(file: str) -> str:
    """Return a relative reference for a relative path, a `file:` URI for an absolute one."""
    path = PurePath(file)
    return path.as_uri() if path.is_absolute() else quote(path.as_posix(), errors="surrogateescape")


# --- GitHub ---

_WORD = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}


def annotations(report: Report) -> str:
    """Return one workflow command for each diagnostic, each on its own line."""
    return "".join(f"{annotation(diagnostic, report.sources)}\n" for diagnostic in report.diagnostics)


def annotation(diagnostic: Diagnostic, sources: Sources) -> str:
    """Return one workflow command; columns only where the place is within a line, as GitHub asks."""
    span = diagnostic.primary.span
    properties = {}
    if span.file:
        source = sources.get(span.file, Source(span.file, ""))
        start, end = source.position(span.start), source.position(max(span.start, span.end - 1))
        properties = {"file": escape(span.file), "line": str(start.line), "endLine": str(end.line)}
        if start.line == end.line:
            properties |= {"col": str(start.column), "endColumn": str(end.column + 1)}
    properties["title"] = diagnostic.code.value
    stated = ",".join(f"{name}={_property(value)}" for name, value in properties.items())
    return f"::{_WORD[diagnostic.severity]} {stated}::{_data(_body(diagnostic))}"


def _body(diagnostic: Diagnostic) -> str:
    lines = [escape(diagnostic.message)]
    for witness in diagnostic.shown:
        lines.append("input: " + escape(witness.said))
        if witness.region:
            lines.append("region: " + escape(region(witness)))
    if diagnostic.left_out:
        lines.append(f"and {diagnostic.left_out}")
    lines += [f"note: {escape(note)}" for note in diagnostic.notes]
    lines += [f"help: {escape(text)}" for text in diagnostic.help]
    return "\n".join(lines)


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
