r"""Pages that are files: each one HTML file that needs nothing else, fetches nothing, and says so to the browser.

>>> from rcsc.views.pages.frame import quoted
>>> quoted("lines `1` & `2`")
Markup('lines <code>1</code> &amp; <code>2</code>')

A page has no script, or one, which the policy names by its hash: whatever else should come to stand in the page is not run. What is
shown is escaped, and data of a script stand in an element that no browser runs:

>>> from rcsc.views.pages.frame import packed
>>> "<" in packed("</script>")
False

The *report* of a run has rows, lines that ran, pictures of what stands outside where there are any, and the run tick by tick by the
studio's parts. The page of a *finding* has no script; it draws what `rcsc prove --log` kept, cycle by cycle.

>>> from rcsc.views.pages.report import ReportRow, Story, page
>>> "every row done" in page(Story("dock", [ReportRow(1, "dock", "done", 70)]))
True

Any system has these; a plant may add what is true of it alone (`Staged.witness`). Nothing here is trusted for a proof. What it costs: a
copy of what is drawn, a cycle; a report keeps a picture every 25 cycles at the least.

A *film* of a run is a file, too: what stands outside, in space, photographed when the run is over.

Modules, in the order the data flows: `frame` reads templates, of which `page.html.jinja` is what all pages have in common; `data` says
who knows the world outside and draws it; `witness` watches a run, `log_page` reads one; `report`, `finding_page` and
`requirement_page` are pages; `documents` has the parts of those that an assessor is handed, of which `dossier_page` is one; `video` is a
film.
"""
