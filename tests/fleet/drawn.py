"""A fleet that tests/fleet/run has drawn, diagnosed and merged: what was concealed is found, and its page as somebody sees it who opens
it. FLEET names its folder."""

import json
import os
import pathlib

import pyarrow.parquet
import pytest

from tests.report.conftest import browser, opens_well  # noqa: F401  (browser is a fixture)

FLEET = pathlib.Path(os.environ["FLEET"])
ANSWERS = FLEET / "answers"
# campaigns from which what grows has to be found
MANY = 60


@pytest.fixture(scope="module")
def truth():
    return json.loads((FLEET / "truth.json").read_text())


@pytest.fixture(scope="module")
def merged():
    return json.loads((ANSWERS / "fleet.json").read_text())


def test_every_campaign_has_its_row(truth, merged):
    rows = pyarrow.parquet.read_table(ANSWERS / "fleet.parquet").to_pylist()
    assert sorted(r["campaign"] for r in rows) == sorted(truth)
    assert merged["campaigns"] == len(truth) and merged["lost"] == []
    assert merged["judged"] + len(merged["not_judged"]) == len(truth)
    for r in rows:
        assert r["column.order"] == truth[r["campaign"]]["order"] and r["column.batch"] == truth[r["campaign"]]["batch"]


def test_what_grows_is_what_was_made_to_grow(truth, merged):
    growth = merged["growth"]
    found = {(g["mechanism"], g["column"]) for g in growth["all"] if g["q"] <= growth["level"]}
    if len(truth) >= MANY:
        assert ("guide_friction", "order") in found
        assert ("plastic_indentation", "batch") in found
        differs = next(g for g in growth["all"] if g["mechanism"] == "plastic_indentation" and g["column"] == "batch" and g["figure"] == "probability")
        assert differs["to"]["of"] == "C"
    # nothing depends on the temperature: of all discoveries one in twenty may be false
    by_chance = [f for f in found if f[1] == "temperature"]
    assert len(by_chance) <= max(1, len(found) // 10), by_chance


@pytest.mark.parametrize("width", [390, 1400])
@pytest.mark.parametrize("dark", [False, True])
def test_the_page_fits_says_nothing_on_the_console_and_asks_for_nothing(browser, width, dark):  # noqa: F811
    opens_well(browser, ANSWERS / "index.html", "fleet", width, dark)


def test_every_campaign_has_a_square_and_a_row_that_lead_to_its_report(browser, truth, merged):  # noqa: F811
    browser.open(ANSWERS / "index.html")
    for what in (".cells a", "td:first-child a"):
        links = browser.js("return [...document.querySelectorAll(arguments[0])].map(a => a.href)", what)
        assert sorted(links) == sorted((ANSWERS / name / "report.html").as_uri() for name in truth)
    sizes = browser.js("return [...document.querySelectorAll('.cells a')].map(a => a.getBoundingClientRect()).map(r => [r.width, r.height])")
    assert all(w > 8 and h > 8 for w, h in sizes)
    lead = browser.js("return document.querySelector('.lead').innerText")
    assert f"{merged['judged']}" in lead
    first = browser.js("const a = document.querySelector('.cells a'); a.click(); return a.href")
    assert browser.js("return location.href") == first
    assert browser.js("return document.querySelector('.pages a').href") == (ANSWERS / "index.html").as_uri()
