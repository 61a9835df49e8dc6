"""Links between the pages, and to files and headings, hold; what pages name is there."""

import re

import pytest

from tests.docs.pages import DOCS, PAGES, ROOT, anchors, code_spans, first_columns, links


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in links(page):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path) if path else page
        assert file.exists(), target
        is_for_a_look = file.suffix == ".webp" and anchor in ("only-light", "only-dark")
        assert not anchor or is_for_a_look or anchor in anchors(file), target


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_pages_name_are_there(page):
    for span in code_spans(page):
        if re.fullmatch(r"(pipeline|app|static|tests|docs|sample_images|\.ci)/[\w./*-]*", span):
            assert list(ROOT.glob(span.rstrip("/"))), span


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_targets_of_make_are_there(page):
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    for span in code_spans(page):
        for target in re.findall(r"\bmake ([a-z-]+)", span):
            assert re.search(rf"^{target}:", text, re.MULTILINE), span


def test_each_page_is_in_the_navigation():
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    named = set(re.findall(r"[\w-]+\.md", text.partition("\nnav:")[2]))
    assert {page.name for page in DOCS.glob("*.md")} <= named


def test_the_layout_is_that_of_the_design():
    named = {name.rstrip("/") for name in first_columns(DOCS / "design.md", "Layout")}
    houses = (ROOT / "pipeline", ROOT / "app")
    assert {name for name in named if not any((house / name).exists() for house in houses)} == set()
    for house in houses:
        folders = {path.parent.name for path in house.glob("*/__init__.py")}
        assert folders <= named


def test_an_anchor_is_as_forges_make_it():
    assert "the-schemas-number" in anchors(DOCS / "outputs.md")
    assert "a-slip-in-print" in anchors(DOCS / "paper.md")


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120
