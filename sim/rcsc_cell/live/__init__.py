"""The live page: what a run does, in a browser on the same machine, while it runs. Needs the extra `live`.

A run publishes after each cycle; the page's server finds the latest of everything on a *board* and sends it on. The
run never waits for a browser, and a browser that is slow sees fewer moments of it. Before that the board thins what
went by, so that a page opened late sees the whole run, coarsely.

    rcsc run make_boxt --live

prints an address with a token that cannot be guessed. The server listens on the loopback interface only, answers only
to that token and that host name, and allows no other page to read it (`rcsc.host.guard`): cross-site requests, framing and
rebinding of names are refused.

Nothing here is trusted for a proof, and the run does not wait for what the page sends. What it costs: a copy of what
is shown, a cycle; the pictures are drawn in the browser's time.

Modules, in the order the data flows: `board` (what a run publishes), `server`; `page.html`,
`page.css` and `page.js` are the page.
"""

from rcsc_cell.live.server import Live

__all__ = ["Live"]
