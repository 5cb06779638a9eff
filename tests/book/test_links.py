"""Every link of the documentation leads somewhere, and every page of the book is in its table of contents."""

import re

import pytest

from tests.book.pages import BOOK, PAGES, ROOT, SOURCE, anchor, anchors, blocks, links, name


def test_headings_have_the_ids_that_mdbook_gives_them():
    assert anchor("The keys of `[rig]`: what is known") == "the-keys-of-rig-what-is-known"
    assert anchor("A [link](x.md) in it") == "a-link-in-it"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_link_of_a_page_leads_somewhere(page):
    wrong = []
    for line, target in links(page):
        if target.startswith(("https://", "mailto:")):
            continue
        path, _, part = target.partition("#")
        to = (page.parent / path).resolve() if path else page
        if not to.exists():
            wrong.append(f"{name(page)}:{line}: there is no {target}")
        elif part and part not in anchors(to):
            wrong.append(f"{name(page)}:{line}: {to.relative_to(ROOT)} has no heading #{part}")
        elif page in BOOK and SOURCE not in to.parents:
            wrong.append(f"{name(page)}:{line}: {target} lies outside of the book")
    assert not wrong, "\n".join(wrong)


def test_every_page_is_in_the_table_of_contents_once():
    summary = SOURCE / "SUMMARY.md"
    listed = [(SOURCE / t).resolve() for _, t in links(summary)]
    assert sorted(listed) == [p for p in BOOK if p != summary]


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_a_page_has_one_title_and_its_own_pictures(page):
    if page.name == "SUMMARY.md":
        return
    titles = [line for line in page.read_text().splitlines() if line.startswith("# ")]
    inside = [line for b in blocks(page) for line in b.text.splitlines() if line.startswith("# ")]
    assert len(titles) - len(inside) == 1, f"{name(page)}: {titles}"
    assert not re.findall(r"!\[[^\]]*\]\((https?:[^)]+)", page.read_text())
