"""`python -m tests.gallery`: make the gallery's page anew."""

from tests.gallery.page import PAGE, page

PAGE.write_text(page(), encoding="utf-8")
