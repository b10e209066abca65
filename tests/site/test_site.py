"""The site: every link and anchor leads somewhere, nothing is fetched, search finds what is there, and each page's commands are run."""

import json
import re
from pathlib import Path

from tests.commands.test_readme import GALLERY_PAGES, GUIDES
from tests.commands.test_tutorial import PAGES
from tests.site.build import pages, site, staged

RUN = {
    *GUIDES,
    *map(str, GALLERY_PAGES),
    *(f"tables/guide/{page}.md" for page in PAGES),
    "tables/guide/integration.md",  # tests/emit/c/test_integration.py
}
"""Pages whose commands a test runs."""
NOT_RUN = {"CONTRIBUTING.md", "tables/guide/editors.md", "tables/examples/amr/README.md"}
"""What sets up a checkout, packs an extension of an editor, or takes minutes to prove."""


def test_every_link_leads_somewhere_and_nothing_is_fetched(tmp_path: Path) -> None:
    staged(tmp_path / "docs")
    assert site(tmp_path / "docs", tmp_path / "site") == []
    for page in pages():
        name = page.replace("README.md", "index.md").removesuffix(".md") + ".html"
        shown = (tmp_path / "site" / name).read_text(encoding="utf-8")
        assert not re.findall(
            r'<(?:script|img|link rel="stylesheet")[^>]*(?:src|href)="(?:https?:)?//', shown
        ), page
    found = json.loads((tmp_path / "site/search/search_index.json").read_text(encoding="utf-8"))["docs"]
    assert any("tables/guide/firmware" in doc["location"] and "run dry" in doc["text"] for doc in found)


def test_what_leads_nowhere_is_told(tmp_path: Path) -> None:
    wrong = "[a](nowhere.md) [b](tutorial.md#nowhere) [c](../nowhere.rcs) [d](../examples/grip.rcs) [e](../task)\n"
    staged(tmp_path / "docs", {"tables/guide/wrong.md": wrong})
    faults = site(tmp_path / "docs", tmp_path / "site")
    assert len(faults) == 3
    assert all("tables/guide/wrong.md" in fault and "nowhere" in fault for fault in faults)
    shown = (tmp_path / "site/tables/guide/wrong.html").read_text(encoding="utf-8")
    assert 'href="../examples/grip.rcs.txt"' in shown
    assert "<code>e</code>" in shown
    assert (tmp_path / "site/tables/examples/grip.rcs.txt").is_file()


def test_the_commands_of_every_page_are_run() -> None:
    repo = Path(__file__).parents[2]
    with_commands = {page for page in pages() if "\n```sh\n" in (repo / page).read_text(encoding="utf-8")}
    assert with_commands - NOT_RUN <= RUN
    assert with_commands >= NOT_RUN
