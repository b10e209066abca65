"""Documents for an assessor: tables and sentences without a script, dark where the reader's screen is, to be printed; and a page of texts.

In: parts in HTML. Out: one page that needs no other file but the texts that its places lead to.
"""

from collections.abc import Iterable, Mapping
from html import escape
from urllib.parse import quote

from rcsc.views.pages.frame import palette

_STYLE = """* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.2rem 1.5rem; max-width: 92rem; background: var(--paper); color: var(--ink);
  font: 14px/1.4 system-ui, sans-serif; }
h1 { font-size: 1.5rem; margin: 0 0 .3rem; }
h2 { font-size: 1.2rem; margin: 2rem 0 .4rem; border-bottom: 2px solid var(--edge); }
h3 { font-size: 1rem; margin: 1.2rem 0 .2rem; }
p { margin: .2rem 0 .5rem; color: var(--soft); max-width: 80rem; }
table { border-collapse: collapse; width: 100%; margin-bottom: .6rem; }
th, td { padding: .2rem .5rem; text-align: left; vertical-align: top; border-bottom: 1px solid var(--edge); overflow-wrap: anywhere; }
th { font-size: .8rem; color: var(--soft); background: var(--panel); }
td { font-size: .82rem; }
code { font: .95em ui-monospace, monospace; }
.soft { color: var(--soft); } .bad { color: var(--bad); font-weight: 600; }
.for { color: var(--accent); font-weight: 600; } a { color: inherit; }
.at { white-space: nowrap; }
.text { counter-reset: line; margin: 0; padding: .4rem 0; font: 12px/1.45 ui-monospace, monospace; overflow-x: auto; }
.text span { display: block; }
.text span::before { counter-increment: line; content: counter(line); display: inline-block; width: 4em; color: var(--soft); }
.text :target { background: var(--lit); color: var(--lit-ink); }
nav a { margin-right: 1rem; }
tr:target { outline: 2px solid var(--accent); }
@media print {
  body { padding: 0; max-width: none; font-size: 9pt; } h2 { break-before: page; }
  tr { break-inside: avoid; } thead { display: table-header-group; }
}
@page { size: A4 landscape; margin: 12mm; }
"""
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
TEXTS = "texts.html"
"""The page of texts, beside that whose places lead there."""


def texts_page(texts: Mapping[str, str]) -> str:
    """Return texts of tables and code, by path, each line with a name that others lead to (`led`)."""
    body = ["<h1>Texts</h1>", "<p>Tables, and the code that is made of them, as they were looked at.</p>"]
    links = (f'<a href="#{escape(quote(path))}">{escape(path)}</a>' for path in texts)
    body.append(f"<nav>{''.join(links)}</nav>")
    for path, text in texts.items():
        lines = "".join(
            f'<span id="{escape(path)}:{at}">{escape(line) or " "}</span>'
            for at, line in enumerate(text.splitlines(), 1)
        )
        body += [f'<h2 id="{escape(path)}">{escape(path)}</h2>', f'<pre class="text">{lines}</pre>']
    return framed("Texts", body)


def led(path: str, line: int | str, shown: str) -> str:
    """Return what is shown of a place as a link to its line on the page of texts."""
    return f'<a href="{TEXTS}#{escape(quote(path))}:{line}">{shown}</a>'


def framed(title: str, body: Iterable[str]) -> str:
    """Return a page of these parts, which needs no script and no other file."""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n<meta name="color-scheme" content="light dark">\n'
        f'<link rel="icon" href="data:,">\n<title>{escape(title)}</title>\n<style>\n{palette()}{_STYLE}</style>\n</head>\n<body>\n'
        + "\n".join(body)
        + "\n</body>\n</html>\n"
    )


def tabled(headings: Mapping[str, int], rows: Iterable[str]) -> str:
    """Return a table; the width of each column in per cent."""
    columns = "".join(f'<col style="width: {width}%">' for width in headings.values())
    heads = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    return f"<table><colgroup>{columns}</colgroup><thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def row(*cells: str, name: str = "") -> str:
    """Return a row of cells that are HTML; a name that others can point at."""
    mark = f' id="{escape(name)}"' if name else ""
    return f"<tr{mark}>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def listing(words: Iterable[str], style: str = "") -> str:
    """Return words one below the other, as a cell."""
    cell = "<br>".join(map(escape, words))
    return f'<span class="{style}">{cell}</span>' if style and cell else cell
