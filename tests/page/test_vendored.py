"""The studio's parts of others are what was fetched, each with its licence, and nothing else stands beside them."""

import hashlib
import json
import re
from pathlib import Path

import pytest

VENDOR = Path(__file__).parents[2] / "rcsc" / "desk" / "studio" / "page" / "vendor"
PARTS = json.loads((VENDOR / "digests.json").read_text(encoding="utf-8"))
PAGE = VENDOR.parent


def test_every_file_is_what_was_fetched() -> None:
    said = {name: digest for part in PARTS.values() for name, digest in part["files"].items()}
    there = {
        path.relative_to(VENDOR).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in VENDOR.rglob("*")
        if path.is_file() and path.name != "digests.json"
    }
    assert there == said


@pytest.mark.parametrize("name", PARTS)
def test_every_part_has_its_licence(name: str) -> None:
    part = PARTS[name]
    [licence] = [file for file in part["files"] if file.endswith("/LICENSE")]
    text = (VENDOR / licence).read_text(encoding="utf-8")
    assert part["licence"] == "MIT"
    assert "Permission is hereby granted, free of charge, to any person obtaining a copy" in " ".join(
        text.split()
    )
    assert "WITHOUT WARRANTY OF ANY KIND" in " ".join(text.split())
    assert re.fullmatch(r"sha512-[A-Za-z0-9+/]{86}==", part["package"])


OUTSIDE = re.compile(
    r"""\bfrom\s*["'](?!\.{1,2}/)|\bimport\s*\(?\s*["'](?!\.{1,2}/)|\bimportScripts\s*\(|\beval\s*\(|\bnew Function\b"""
)
"""What would take something that is not of the page, or make code of text."""


@pytest.mark.parametrize(
    "path", sorted(PAGE.rglob("*.js")), ids=lambda path: path.relative_to(PAGE).as_posix()
)
def test_no_script_asks_for_what_is_elsewhere(path: Path) -> None:
    code = re.sub(r"^\s*/\*\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    code = re.sub(r"^\s*(?://|\*|/\*).*$", "", code, flags=re.MULTILINE)
    assert [found.group() for found in OUTSIDE.finditer(code)] == []


def test_the_page_names_nothing_elsewhere_and_has_no_code_inside() -> None:
    for path in [*PAGE.glob("*.html"), *PAGE.glob("*.css")]:
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"https?://|url\((?!data:|#)", text), path
        assert not re.search(r"<script(?![^>]*\bsrc=)[^>]*>|<style|\sstyle=|\son\w+=", text), path
