"""Diagnostics as GitHub workflow commands, which show as annotations on the changed lines.

Source: GitHub documentation, "Workflow commands for GitHub Actions"; the escapes are those of the
runner's `ActionCommand` (`%`, CR and LF in data, and `:` and `,` too in properties).
"""

from rcsc.base.diagnostics.diagnostic import Diagnostic, Severity
from rcsc.base.diagnostics.printable import escape
from rcsc.base.diagnostics.render import region
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Source, Sources

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
        values = zip(witness.variables, witness.values, strict=True)
        lines.append("input: " + escape(", ".join(f"{name} = {value}" for name, value in values)))
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
