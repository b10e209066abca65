"""`python -m tests.gallery`: make the gallery's page anew; `--mended`: try all its mended tables, interpreter = Python = C."""

import sys

from rcsc.front.commands import run
from tests.gallery.page import MENDED, PAGE, page

if "--mended" in sys.argv:
    sys.exit(run(["test", "--examples", "20", "--mutants", "0", "--no-cortex", *map(str, MENDED)]))
PAGE.write_text(page(), encoding="utf-8")
