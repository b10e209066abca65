"""Pages about a run: HTML files that need nothing else, and who watches a run for them.

A page fetches nothing, and says so to the browser; what is shown is escaped. The *report* of a run has rows, lines that ran,
pictures of what stands outside where there are any, and the run tick by tick by the studio's parts. The page of a *finding* has no
script; it draws what `rcsc prove --log` kept, cycle by cycle.

>>> from rcsc_cell.pages.report import ReportRow, Story, page
>>> "every row done" in page(Story("dock", [ReportRow(1, "dock", "done", 70)]))
True

Any system has these; the paper's cell adds what is true of it alone. Nothing here is trusted for a proof. What it costs:
a copy of what is drawn, a cycle; a report keeps a picture every 25 cycles at the least.

Modules, in the order the data flows: `witness` watches a run, `log_page` reads one, `report` and `finding_page` are
pages (`page`).
"""
