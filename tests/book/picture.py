"""Draws the top of a demo's report into the book: python -m tests.book.picture DEMO"""

import base64
import pathlib
import sys

from tests.book.pages import SOURCE
from tests.report.conftest import FINDING, Browser

WIDTH, HEIGHT = 1200, 1350          # px


def main():
    browser = Browser()
    try:
        browser.open(pathlib.Path(sys.argv[1]).resolve() / FINDING, width=WIDTH)
        clip = {"x": 0, "y": 0, "width": WIDTH, "height": HEIGHT, "scale": 1}
        shot = browser.driver.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True, "clip": clip})
    finally:
        browser.driver.quit()
    path = SOURCE / "images" / "report.png"
    path.write_bytes(base64.b64decode(shot["data"]))
    print(f"{path}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
