r"""Pages that are files: each one HTML file that needs nothing else, fetches nothing, and says so to the browser.

>>> from rcsc.pages.frame import quoted
>>> quoted("lines `1` & `2`")
Markup('lines <code>1</code> &amp; <code>2</code>')

A page has no script, or one, which the policy names by its hash: whatever else should come to stand in the page is not run. What is
shown is escaped, and data of a script stand in an element that no browser runs:

>>> from rcsc.pages.frame import packed
>>> "<" in packed("</script>")
False

Reports of runs, findings, and what the studio shares are made in this way.

Modules: `frame` reads templates; `page.html.jinja` is what all pages have in common.
"""
