"""Every page of the demo as somebody sees it who opens it."""

import json
import re

import pytest
from selenium.webdriver import ActionChains, Keys
from selenium.webdriver.common.by import By

from .conftest import FINDING, INSIDE, PAGES, opens_well

LOOKS = [(w, d) for w in (390, 1400) for d in (False, True)]


@pytest.mark.parametrize("page", PAGES + INSIDE)
@pytest.mark.parametrize("width,dark", LOOKS)
def test_a_page_fits_its_width_says_nothing_on_the_console_and_asks_for_nothing(browser, demo, inside, page, width, dark):
    opens_well(browser, (inside if page in INSIDE else demo) / page, page.replace("/", "-").removesuffix(".html"), width, dark)
    bright = browser.js("return getComputedStyle(document.body).backgroundColor.match(/\\d+/g).slice(0, 3).reduce((a, b) => a + +b, 0) > 380")
    assert bright != dark


def contrast(a, b):
    """WCAG contrast of two colours, each (r, g, b)."""
    def light(c):
        v = [x / 255 / 12.92 if x / 255 <= 0.04045 else ((x / 255 + 0.055) / 1.055) ** 2.4 for x in c]
        return 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]
    high, low = sorted((light(a), light(b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("dark", [False, True])
def test_text_and_lines_stand_out(browser, demo, dark):
    browser.open(demo / FINDING, 1400, dark)
    def colour(selector, what):
        return [int(x) for x in re.findall(r"\d+", browser.js("return getComputedStyle(document.querySelector(arguments[0]))[arguments[1]]", selector, what))[:3]]
    paper = colour("body", "backgroundColor")
    for selector in [".lead", ".card dd p", "h1", "figcaption", ".keys li", ".contents a"]:
        assert contrast(colour(selector, "color"), paper) > 4.5, selector
    for selector in ["path.given", "path.before", "path.after"]:
        assert contrast(colour(f".plot {selector}", "stroke"), paper) > 3.0, selector


def test_the_finding_comes_first_and_its_card_is_in_order(browser, demo):
    for page in (FINDING, "index.html"):
        browser.open(demo / page, 390)
        card = browser.js("return document.querySelector('main').firstElementChild.innerText")
        at = [card.index(t) for t in ("leaves out plastic indentation", "How sure", "What it does", "peak force", "restitution", "contact time", "depth", "What to do next")]
        assert at == sorted(at), card
        # on a phone what is wrong stands on the first screen
        assert browser.js("return document.querySelector('.lead').getBoundingClientRect().bottom < 600")


def test_pages_are_linked_both_ways(browser, demo):
    browser.open(demo / "index.html")
    links = browser.js("return [...document.querySelectorAll('main a')].map(a => a.href)")
    assert sum(u.endswith("report.html") for u in links) == 6
    for url in [u for u in links if u.endswith("report.html")]:
        browser.driver.get(url)
        up = browser.js("return document.querySelector('.pages a').href")
        assert up == (demo / "index.html").as_uri()
    browser.open(demo / "diagnosis/index.html")
    assert browser.js("return document.querySelector('.entry a').href") == (demo / FINDING).as_uri()


def test_without_the_script_everything_can_be_read(browser, demo):
    browser.open(demo / FINDING, 1400, script=False)
    browser.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    assert browser.js("return document.querySelectorAll('.keys button, .tools').length") == 0
    charts = browser.js("return [...document.querySelectorAll('main > .figures svg.chart')].map(s => [s.querySelector('title')?.textContent, s.querySelector('desc').textContent, s.getAttribute('aria-label'), s.getBoundingClientRect().height])")
    assert len(charts) > 8
    assert all(title and desc and label and height > 60 for title, desc, label, height in charts)
    names = browser.js("return document.querySelector('.keys').innerText")
    assert all(n in names for n in ("measured", "as given", "recalibrated", "physics found")), names


def test_the_pulse_fills_the_axis_and_its_peak_is_drawn_where_it_is(browser, demo):
    browser.open(demo / FINDING)
    chart = "const s = [...document.querySelectorAll('svg.chart')].find(s => s.getAttribute('aria-label').startsWith('Force: force over time'));"
    low, high, factor, unit = browser.js(chart + "return s.dataset.x").split(" ")
    assert unit == "ms" and float(factor) == 1e3 and float(high) - float(low) < 1.2e-3
    d = browser.js(chart + "return s.querySelector('path.measured').getAttribute('d')")
    points = [tuple(map(float, p)) for p in re.findall(r"[ML](-?[\d.]+),(-?[\d.]+)", d)]
    inside = [p for p in points if 0 <= p[0] <= 536]
    assert len(inside) > 150 and sum(x != round(x) and y != round(y) for x, y in inside) > 0.8 * len(inside)
    a, b, *_ = browser.js(chart + "return s.dataset.y").split(" ")
    height = float(browser.js(chart + "return s.querySelector('.plot').getAttribute('height')"))
    peak = float(b) - min(y for _, y in inside) / height * (float(b) - float(a))
    rows = [line.split(",") for line in (demo / "input/bench_drop/r09.csv").read_text().splitlines()]
    column = next(i for i, name in enumerate(rows[0]) if name.startswith("force"))
    largest = max(float(r[column]) for r in rows[1:]) * (1e3 if "[kN]" in rows[0][column] else 1.0)
    assert abs(peak / largest - 1) < 1e-3, (peak, largest)


def test_no_line_crosses_free_flight(browser, demo):
    browser.open(demo / "contactor/report.html")
    chart = "const s = [...document.querySelectorAll('svg.chart')].find(s => s.getAttribute('aria-label').startsWith('Every impact'));"
    d = browser.js(chart + "return s.querySelector('path.line0').getAttribute('d')")
    low, high, *_ = browser.js(chart + "return s.dataset.x").split(" ")
    width = float(browser.js(chart + "return s.querySelector('.plot').getAttribute('width')"))
    base = max(float(y) for y in re.findall(r",(-?[\d.]+)", d))
    points = [tuple(map(float, p)) for p in re.findall(r"[ML](-?[\d.]+),(-?[\d.]+)", d)]
    impacts = [(b["touch"], b["touch"] + b["duration"]) for b in json.loads((demo / "contactor/summary.json").read_text())["runs"][0]["impacts"]]
    px = [[width * (t - float(low)) / (float(high) - float(low)) for t in pair] for pair in impacts]
    flights = 0
    for (_, left), (touch, _) in zip(px, px[1:]):
        for (x0, y0), (x1, y1) in zip(points, points[1:]):
            if x1 > left + 1 and x0 < touch - 1:
                flights += 1
                assert y0 > base - 0.1 and y1 > base - 0.1 or x0 < left + 1 and x1 < left + 2, (x0, y0, x1, y1)
    assert flights > 5


def chart(browser, label):
    return next(s for s in browser.driver.find_elements(By.CSS_SELECTOR, "svg.chart") if s.get_attribute("aria-label").startswith(label))


def shown(browser):
    return browser.js("return [...document.querySelectorAll('.readout')].filter(b => !b.hidden).map(b => b.innerText)")


def test_hover_reads_values_and_linked_charts_follow(browser, demo):
    browser.open(demo / FINDING)
    force = chart(browser, "Force: force over time")
    browser.js("arguments[0].scrollIntoView({block: 'center'})", force)
    ActionChains(browser.driver).move_to_element(force).perform()
    read = shown(browser)
    # force, its residual, acceleration with residual, penetration with residual, and the loop
    assert len(read) == 7 and all("recalibrated" in r for r in read), read
    assert any("kN" in r and "ms" in r and "measured" in r for r in read), read
    browser.shot("hover-1400-light", whole=False)
    ActionChains(browser.driver).move_to_element(chart(browser, "r09.csv")).perform()
    assert len(shown(browser)) == 7
    ActionChains(browser.driver).move_to_element(browser.driver.find_element(By.CSS_SELECTOR, "h1")).perform()
    assert shown(browser) == [] and browser.errors() == []


def test_names_switch_lines_by_mouse_and_by_key(browser, demo):
    browser.open(demo / FINDING)
    force = chart(browser, "Force: force over time")
    figure = force.find_element(By.XPATH, "./ancestor::figure")
    button = next(b for b in figure.find_elements(By.CSS_SELECTOR, ".keys button") if b.text == "recalibrated")
    line = force.find_element(By.CSS_SELECTOR, "path.before")
    browser.js("arguments[0].scrollIntoView({block: 'center'})", force)
    button.click()
    assert button.get_attribute("aria-pressed") == "false" and not line.is_displayed()
    # the residual below, which has no names of its own, follows
    below = browser.js("return arguments[0].closest('.stack').querySelectorAll('path.before[hidden]').length", force)
    assert below == 2
    button.send_keys(Keys.SPACE)
    assert button.get_attribute("aria-pressed") == "true" and line.is_displayed()


def test_keys_move_the_cursor_and_are_heard(browser, demo):
    browser.open(demo / FINDING)
    force = chart(browser, "Force: force over time")
    browser.js("arguments[0].focus()", force)
    ActionChains(browser.driver).send_keys(Keys.HOME, Keys.ARROW_RIGHT).perform()
    first = browser.js("return document.querySelector('.heard').textContent")
    ActionChains(browser.driver).key_down(Keys.SHIFT).send_keys(Keys.ARROW_RIGHT * 3).key_up(Keys.SHIFT).perform()
    then = browser.js("return document.querySelector('.heard').textContent")
    assert "ms" in first and "measured" in first and first != then
    ActionChains(browser.driver).send_keys(Keys.ESCAPE).perform()
    assert shown(browser) == []
    # every stop on the way through the page shows where it is
    browser.js("document.activeElement.blur(); scrollTo(0, 0)")
    for _ in range(12):
        ActionChains(browser.driver).send_keys(Keys.TAB).perform()
        assert browser.js("return document.activeElement !== document.body && getComputedStyle(document.activeElement).outlineStyle") == "solid"
    assert browser.errors() == []


def test_zoom_by_drag_by_button_and_back(browser, demo):
    browser.open(demo / FINDING)
    force = chart(browser, "Force: force over time")
    browser.js("arguments[0].scrollIntoView({block: 'center'})", force)
    ticks = "return [...arguments[0].querySelectorAll('g.x text')].map(t => t.textContent)"
    first, line = browser.js(ticks, force), force.find_element(By.CSS_SELECTOR, "path.measured").get_attribute("d")
    loop = browser.js(ticks, chart(browser, "r09.csv"))
    ActionChains(browser.driver).move_to_element(force).click_and_hold().move_by_offset(90, 0).release().perform()
    zoomed = browser.js(ticks, force)
    assert zoomed != first and browser.js(ticks, chart(browser, "Acceleration: acceleration over time")) == zoomed
    assert browser.js(ticks, chart(browser, "r09.csv")) == loop, "another axis stays"
    figure = force.find_element(By.XPATH, "./ancestor::figure")
    buttons = {b.get_attribute("aria-label"): b for b in figure.find_elements(By.CSS_SELECTOR, ".tools button")}
    buttons["The whole recording"].click()
    assert float(browser.js(ticks, force)[-1].replace("\u2212", "-")) > float(first[-1])
    buttons["As at first"].click()
    assert browser.js(ticks, force) == first
    assert force.find_element(By.CSS_SELECTOR, "path.measured").get_attribute("d") == line
    assert browser.errors() == []


def test_it_prints(browser, demo):
    browser.open(demo / FINDING)
    pdf = browser.pdf()
    assert pdf.startswith(b"%PDF") and 3 <= len(re.findall(rb"/Type\s*/Page\b", pdf)) <= 9
    assert browser.errors() == []
