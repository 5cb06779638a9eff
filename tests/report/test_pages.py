"""Every page of the demo as somebody sees it who opens it."""

import base64
import csv
import hashlib
import json
import os
import re
import shutil
import struct
import subprocess
import tomllib

import pytest
from selenium.webdriver import ActionChains, Keys
from selenium.webdriver.common.by import By

from .conftest import FINDING, INSIDE, PAGES, ROOT, opens_well

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
    browser.open(demo / "several/index.html")
    entries = browser.js("return [...document.querySelectorAll('.entry a')].map(a => a.href)")
    assert entries == [(demo / "several" / name / "report.html").as_uri() for name in ("again", "once")]
    browser.driver.get(entries[0])
    assert browser.js("return document.querySelector('.pages a').href") == (demo / "several/index.html").as_uri()
    # of a single campaign there is none above, and none is named
    assert not (demo / "diagnosis/index.html").exists() and "All campaigns" not in (demo / FINDING).read_text()


def test_without_the_script_everything_can_be_read(browser, demo):
    browser.open(demo / FINDING, 1400, script=False)
    browser.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    assert browser.js("return document.querySelectorAll('.keys button, .tools').length") == 0
    assert "SHA-256" in browser.js("return document.querySelector('.trace').innerText")
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
    # force and its residual in one unit
    assert any(" N" in r and "ms" in r and "measured" in r for r in read) and not any("kN" in r for r in read), read
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


def press(browser, name):
    """Presses a button by its name as it is heard, with the keyboard."""
    button = next(b for b in browser.driver.find_elements(By.CSS_SELECTOR, "main button") if b.get_attribute("aria-label") == name)
    browser.js("arguments[0].scrollIntoView({block: 'center'}); arguments[0].focus()", button)
    ActionChains(browser.driver).send_keys(Keys.ENTER).perform()


def rows(file):
    with file.open(newline="") as f:
        return list(csv.reader(f))


def test_a_chart_is_handed_out_as_values_with_all_their_digits(browser, demo, tmp_path):
    browser.requests(), browser.errors()
    browser.open(demo / FINDING)
    file = browser.download(tmp_path, lambda: press(browser, "Values: Force: force over time from touch"))
    assert file.name == "Diagnosis_of_bench_drop_Force_force_over_time_from_touch.csv"
    head, *values = rows(file)
    assert head == ["time from touch [s]", "measured: force [N]", "as given: force [N]", "recalibrated: force [N]", "physics found: force [N]"]
    read = rows(demo / "input/bench_drop/r09.csv")
    column = next(i for i, name in enumerate(read[0]) if name.startswith("force"))
    scale = 1e3 if "[kN]" in read[0][column] else 1.0
    force = [float(r[column]) * scale for r in read[1:]]
    most = max(map(abs, force))
    assert len(values) == len(force)
    assert all(abs(float(r[1]) - f) <= 1e-11 * most for r, f in zip(values, force))
    found = rows(demo / "diagnosis/bench_drop/predictions/after/r09.csv")
    assert all(abs(float(r[4]) - scale * float(f[column])) <= 1e-11 * most for r, f in zip(values, found[1:]))
    # a loop has each line's own places
    head, *values = rows(browser.download(tmp_path, lambda: press(browser, "Values: r09.csv, 0.12 m: force over penetration")))
    assert head[:4] == ["measured: penetration [m]", "measured: force [N]", "as given: penetration [m]", "as given: force [N]"]
    assert len(values) > 300
    # nothing was asked for but the page and what it handed out
    asked = [json.loads(m)["message"]["params"]["request"]["url"] for m in browser.requests()]
    assert [u for u in asked if not u.startswith(("file:", "data:", "blob:"))] == [] and browser.errors() == []


@pytest.mark.parametrize("dark", [False, True])
def test_a_chart_is_handed_out_as_a_picture_on_the_pages_paper(browser, demo, tmp_path, dark):
    browser.open(demo / FINDING, 1400, dark)
    shot = browser.download(tmp_path, lambda: press(browser, "Picture: Restitution: restitution over speed at touch"))
    data = shot.read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n") and shot.name.endswith(".png")
    width, height = struct.unpack(">II", data[16:24])
    assert width > 800 and height > 600
    # what the picture shows, read back by the browser
    browser.js("window.seen = null; const i = new Image(); i.onload = () => { const c = document.createElement('canvas'); c.width = i.width; c.height = i.height; const p = c.getContext('2d'); p.drawImage(i, 0, 0); const d = p.getImageData(0, 0, i.width, i.height).data; const all = {}; for (let k = 0; k < d.length; k += 4) { const v = [d[k], d[k + 1], d[k + 2]].join(); all[v] = (all[v] || 0) + 1; } window.seen = [[d[0], d[1], d[2]], all]; }; i.src = 'data:image/png;base64,' + arguments[0];", base64.b64encode(data).decode())
    browser.driver.set_script_timeout(10)
    paper, colours = browser.driver.execute_async_script("const done = arguments[0]; const look = () => window.seen ? done(window.seen) : setTimeout(look, 20); look();")
    assert (sum(paper) < 380) == dark
    for name in ("measured", "given", "before", "after"):
        stroke = browser.js("return getComputedStyle(document.querySelector(arguments[0])).stroke.match(/\\d+/g).slice(0, 3).join()", f".plot path.{name}")
        assert colours.get(stroke, 0) > 20, name
    assert browser.errors() == []


def test_every_chart_and_every_table_has_its_files(browser, demo):
    for page in PAGES:
        browser.open(demo / page)
        lacking = browser.js("""
            const label = (e, what) => [...e.querySelectorAll('.tools button')].some(b => b.textContent === what);
            const charts = [...document.querySelectorAll('figure')].filter(f => f.querySelector('svg.chart') && !(label(f, 'PNG') && label(f, 'CSV')));
            const tables = [...document.querySelectorAll('main .scroll')].filter(s => !s.closest('.data') && s.querySelector('table') && !s.nextElementSibling?.querySelector('button'));
            return [...charts, ...tables].map(e => e.outerHTML.slice(0, 200));""")
        assert lacking == [], page
        names = browser.js("return [...document.querySelectorAll('.tools button')].map(b => b.getAttribute('aria-label')).filter(n => /^(Values|Picture)/.test(n))")
        assert all(names) and browser.errors() == []
    # paper shows none
    browser.open(demo / FINDING)
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    shown = browser.js("return [...document.querySelectorAll('.tools')].filter(e => getComputedStyle(e).display !== 'none').length")
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    assert shown == 0


def test_a_table_is_handed_out_with_units_in_its_head(browser, demo, tmp_path):
    browser.open(demo / FINDING)
    verdict = json.loads((demo / "diagnosis/bench_drop/verdict.json").read_text())
    head, *values = rows(browser.download(tmp_path, lambda: press(browser, "Values: Plastic indentation (Thornton), Table by parameter")))
    assert head == ["parameter", "value [m]", "95 % interval by profile likelihood, low [m]", "95 % interval by profile likelihood, high [m]"]
    of = verdict["missing"][0]["parameters"]["yield_penetration"]
    assert [float(v) for v in values[0][1:]] == [of["value"], *of["ci95"]]
    head, *values = rows(browser.download(tmp_path, lambda: press(browser, "Values: Misfit of every level, predicted without it, Table by force, level")))
    assert head == ["force, level", "recordings [1]", "noise [N]", "recalibrated [N]", "over noise [1]", "physics found [N]", "over noise [1]"]
    levels = verdict["fit"]["levels"]
    assert [float(r[3]) for r in values] == [level["channels"][0]["rms"]["before"] for level in levels]
    # units that differ from row to row stand beside the numbers
    head, *values = rows(browser.download(tmp_path, lambda: press(browser, "Values: Back in the simulator: HysteresisContact.fmu, Table by parameter")))
    assert head[:3] == ["parameter", "start value", "start value, unit"] or "start value, unit" in head
    start = {r[0]: r for r in values}["stiffness"]
    assert float(start[1]) == verdict["element"]["starts"]["stiffness"]["value"] and "N/m^p" in start
    head, *values = rows(browser.download(tmp_path, lambda: press(browser, "Values: Where the mismatch sits, Recalibrated")))
    assert head[1] == "force approach" and float(values[0][1]) == verdict["map"][0]["before"] and browser.errors() == []


def test_figures_on_shades_can_be_read(browser, demo):
    for dark in (False, True):
        browser.open(demo / FINDING, 1400, dark)
        cells = browser.js("""
            const pen = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
            const rgb = (c) => { pen.clearRect(0, 0, 1, 1); pen.fillStyle = c; pen.fillRect(0, 0, 1, 1); return [...pen.getImageData(0, 0, 1, 1).data].slice(0, 3); };
            return [...document.querySelectorAll('.heat tbody td')].map(e => { const s = getComputedStyle(e); return [rgb(s.color), rgb(s.backgroundColor), e.textContent]; });""")
        assert len(cells) > 60
        assert min(contrast(ink, shade) for ink, shade, _ in cells) >= 4.5, dark
        # and any shade that there may be
        shades = browser.js("""
            const td = document.querySelector('.heat tbody td:not(.none)');
            const pen = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
            const rgb = (c) => { pen.clearRect(0, 0, 1, 1); pen.fillStyle = c; pen.fillRect(0, 0, 1, 1); return [...pen.getImageData(0, 0, 1, 1).data].slice(0, 3); };
            return [...Array(101).keys()].map(u => { td.className = u > 79 ? 'deep' : ''; td.style.setProperty('--u', `${u}%`); const s = getComputedStyle(td); return [rgb(s.color), rgb(s.backgroundColor)]; });""")
        assert min(contrast(ink, shade) for ink, shade in shades) >= 4.5, dark


def test_a_loop_ends_before_the_frame_and_stands_beside_others_in_one_unit(browser, demo):
    browser.open(demo / FINDING)
    loops = browser.js("return [...document.querySelectorAll('svg.chart')].filter(s => s.querySelector('path[data-along]')).map(s => [s.querySelector('.plot').getAttribute('width'), s.dataset.x.split(' ')[3], s.dataset.y.split(' ')[3], [...s.querySelectorAll('path[data-along]')].map(p => p.getAttribute('d'))])")
    assert len(loops) == 5
    for width, _, _, lines in loops:
        for d in lines:
            x = [float(v) for v in re.findall(r"[ML](-?[\d.]+),", d)]
            assert max(x) < 0.985 * float(width) and min(x) > 0.015 * float(width)
    assert len({(x, y) for _, x, y, _ in loops[1:]}) == 1, loops
    stacks = browser.js("return [...document.querySelectorAll('.stack')].map(s => [...s.querySelectorAll('svg.chart')].map(c => c.dataset.y.split(' ').slice(3).join(' ')))")
    assert all(len(set(units)) == 1 for units in stacks) and any(len(units) == 2 for units in stacks)


def test_a_page_says_where_it_comes_from(browser, demo, tmp_path):
    for page in PAGES:
        browser.open(demo / page)
        foot = browser.js("return document.querySelector('body > footer.trace').innerText")
        assert re.search(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC", foot) and "touchdown" in foot and re.search(r"commit ([0-9a-f]{40}|unknown)", foot), page
    browser.open(demo / FINDING)
    foot = browser.js("return document.querySelector('.trace').innerText")
    assert "touchdown diagnose " in foot and "10, sampled at " in foot and "0.3262 kg" in foot
    for file in sorted((demo / "input/bench_drop").iterdir()):
        if file.name == "campaign.toml" or file.suffix == ".csv":
            assert f"{hashlib.sha256(file.read_bytes()).hexdigest()} {file.name}" in foot
    # the verdict has the same, but for what is not of the input
    trace = json.loads((demo / "diagnosis/bench_drop/verdict.json").read_text())["trace"]
    assert set(trace) == {"touchdown", "moving_mass", "recordings", "sampling_rates", "inputs"}
    assert trace["moving_mass"] == tomllib.loads((demo / "input/bench_drop/campaign.toml").read_text())["rig"]["moving_mass"]
    assert all(i["sha256"] in foot for i in trace["inputs"]) and len(trace["inputs"]) == 11


def test_with_a_date_given_the_same_input_gives_the_same_bytes(demo, tmp_path):
    campaign = tmp_path / "drops"
    shutil.copytree(demo / "input/bench_drop", campaign)
    text = (campaign / "campaign.toml").read_text()
    (campaign / "campaign.toml").write_text(text.replace("[campaign]\n", '[campaign]\noperator = "A. N. Other <x>"\n', 1))
    program = os.environ.get("TOUCHDOWN", str(ROOT / "target/release/touchdown"))

    def answer(epoch):
        env = os.environ | ({"SOURCE_DATE_EPOCH": epoch} if epoch else {})
        done = subprocess.run([program, "diagnose", str(campaign), "--out", str(tmp_path / "out")], env=env, capture_output=True, text=True)
        return done, *((tmp_path / "out/drops" / n).read_bytes() if done.returncode == 0 else b"" for n in ("report.html", "verdict.json"))

    _, first, verdict = answer("1000000000")
    _, second, same = answer("1000000000")
    assert first == second and verdict == same
    assert b"2001-09-09 01:46:40 UTC" in first and b"A. N. Other &lt;x&gt;" in first
    assert json.loads(verdict)["trace"]["operator"] == "A. N. Other <x>"
    # the clock is on the page alone
    _, dated, same = answer(None)
    assert dated != first and same == verdict
    refused, *_ = answer("yesterday")
    assert refused.returncode == 2 and "SOURCE_DATE_EPOCH" in refused.stderr


def test_terminal_page_and_verdict_tell_the_same_figures(browser, demo, tmp_path):
    program = os.environ.get("TOUCHDOWN", str(ROOT / "target/release/touchdown"))
    said = subprocess.run([program, "diagnose", str(demo / "input/bench_drop"), "--out", str(tmp_path)], check=True, capture_output=True, text=True).stdout
    verdict = json.loads((tmp_path / "bench_drop/verdict.json").read_text())
    browser.open(tmp_path / "bench_drop/report.html")
    page = browser.js("return document.querySelector('main').innerText").replace("\u00a0", " ").replace("\u2212", "-")
    fit, effect = verdict["fit"], verdict["material"]["plastic_indentation"]
    before, after = fit["before"], fit["after"]
    figures = [
        f"goes from {100 * before['heldout_nrmse']:.2f} % to {100 * after['heldout_nrmse']:.2f} % of range",
        f"from {before['heldout_over_noise']:.1f} to {after['heldout_over_noise']:.1f} times the noise",
        f"differ by {100 * verdict['remainder']['peak_force']:.2f} %",
        *(f"{level['over_noise']['before']:.1f} to {level['over_noise']['after']:.1f} at {level['level']}" for level in fit["levels"]),
    ]
    assert len(figures) == 8
    for text in figures:
        assert text in said and text in page, (text, said)
    for figure, value in effect.items():
        assert f"{figure.replace('_', ' ')} {100 * value:+.2f} %" in said
        assert f"{100 * value:+.2f} %" in page
    for of in verdict["missing"][0]["parameters"].values():
        assert f"{of['value']:.3e} m".replace("e-0", "e-") in said and f"{1e6 * of['value']:.1f}" in page
