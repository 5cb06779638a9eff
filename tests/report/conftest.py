"""The demo's pages, made once, and a headless browser to look at them with."""

import base64
import json
import os
import pathlib
import shutil
import subprocess
import time
import zipfile

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = ["index.html", "drop_test/report.html", "contactor/report.html", "fit/report.html", "diagnosis/bench_drop/report.html", "same_drops/report.html", "fmus/bench_contactor/report.html", "several/index.html"]
# the pages inside the FMU handed back
INSIDE = ["documentation/index.html", "documentation/cosimulation.html"]
FINDING = "diagnosis/bench_drop/report.html"


@pytest.fixture(scope="session")
def demo(tmp_path_factory):
    """Folder of the demo, made here or beforehand, and beside it the answers to several campaigns, which have a page above them."""
    program = os.environ.get("TOUCHDOWN", str(ROOT / "target/release/touchdown"))
    quiet = {"check": True, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    if "REPORT_DEMO" in os.environ:
        out = pathlib.Path(os.environ["REPORT_DEMO"]).resolve()
    else:
        out = tmp_path_factory.mktemp("pages") / "demo"
        subprocess.run([program, "demo", "--out", str(out)], **quiet)
    if not (out / "several").exists():
        campaigns = [tmp_path_factory.mktemp("campaigns") / name for name in ("once", "again")]
        for c in campaigns:
            shutil.copytree(out / "input/bench_drop", c)
        subprocess.run([program, "diagnose", *map(str, campaigns), "--out", str(out / "several")], **quiet)
    return out


@pytest.fixture(scope="session")
def inside(demo, tmp_path_factory):
    """Folder of the FMU that the demo's diagnosis hands back, unpacked."""
    out = tmp_path_factory.mktemp("fmu")
    with zipfile.ZipFile(demo / "diagnosis/bench_drop/HysteresisContact.fmu") as z:
        for page in INSIDE:
            z.extract(page, out)
    return out


class Browser:
    def __init__(self):
        options = Options()
        options.binary_location = shutil.which("chromium")
        for a in ["--headless=new", "--no-sandbox", "--hide-scrollbars", "--disable-gpu", "--disable-dev-shm-usage"]:
            options.add_argument(a)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))

    def open(self, path, width=1400, dark=False, script=True):
        """Opens a page; width in px, a phone below 600."""
        self.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": not script})
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]})
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600})
        self.driver.get(pathlib.Path(path).as_uri())

    def js(self, text, *args):
        return self.driver.execute_script(text, *args)

    def download(self, folder, act, wait=10.0):
        """The file that `act` makes the page hand out, read from `folder`."""
        folder.mkdir(parents=True, exist_ok=True)
        self.driver.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(folder)})
        before = set(folder.iterdir())
        act()
        end = time.monotonic() + wait
        while time.monotonic() < end:
            new = [p for p in set(folder.iterdir()) - before if p.suffix != ".crdownload"]
            if new and new[0].stat().st_size:
                return new[0]
            time.sleep(0.05)
        raise AssertionError("nothing was handed out")

    def errors(self):
        return [e for e in self.driver.get_log("browser") if e["level"] in ("SEVERE", "WARNING")]

    def requests(self):
        """Addresses asked for since the last time."""
        return [e["message"] for e in self.driver.get_log("performance") if '"Network.requestWillBeSent"' in e["message"]]

    def pdf(self):
        return base64.b64decode(self.driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": True, "preferCSSPageSize": True})["data"])

    def shot(self, name, whole=True):
        """Keeps a picture of the whole page, or of what is on the screen, where REPORT_SHOTS names a folder."""
        if "REPORT_SHOTS" not in os.environ:
            return
        folder = pathlib.Path(os.environ["REPORT_SHOTS"])
        folder.mkdir(parents=True, exist_ok=True)
        if not whole:
            self.driver.save_screenshot(str(folder / f"{name}.png"))
            return
        width, height = self.js("return [document.documentElement.clientWidth, document.documentElement.scrollHeight]")
        shot = self.driver.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True, "clip": {"x": 0, "y": 0, "width": width, "height": min(height, 12000), "scale": 1}})
        (folder / f"{name}.png").write_bytes(base64.b64decode(shot["data"]))


@pytest.fixture(scope="session")
def browser():
    b = Browser()
    yield b
    b.driver.quit()


def opens_well(browser, page, name, width, dark):
    """Opens a page, keeps a picture of it by its name, and holds it to what every page promises: it fits its width, says nothing on the console and asks for nothing."""
    browser.requests(), browser.errors()
    browser.open(page, width, dark)
    browser.shot(f"{name}-{width}-{'dark' if dark else 'light'}")
    assert browser.errors() == []
    asked = [json.loads(m)["message"]["params"]["request"]["url"] for m in browser.requests()]
    assert [u for u in asked if not u.startswith(("file:", "data:"))] == [] and len([u for u in asked if u.startswith("file:")]) == 1, asked
    assert browser.js("return document.documentElement.scrollWidth") <= width
    # nothing but what scrolls by itself, or is cut off at a plot's edge, reaches beyond the page
    beyond = browser.js("return [...document.querySelectorAll('main *')].filter(e => !e.closest('.scroll, pre, .heard, .plot') && e.getBoundingClientRect().right > innerWidth + 1).map(e => e.outerHTML.slice(0, 80))")
    assert beyond == []
