"""Pages: one HTML file that needs nothing else, has no scripts and fetches nothing, and says so to the browser.

In: a template of this folder, and what it shows. Out: its text; what is shown is escaped.
"""

from rcsc.pages.frame import environment, quoted

__all__ = ["PAGES", "quoted"]
PAGES = environment("rcsc_cell", "pages")
