"""Pictures of a report for README and docs, in docs/images: ``python docs/site/screenshots.py
SESSION TITLE``.

Needs chromium, as the tests of the page do.
"""

import os
import shutil
import sys
import tempfile
from pathlib import Path

from matplotlib.image import imread, imsave
from numpy import concatenate, ones
from playwright.sync_api import Browser, sync_playwright

from pipelines.report.html.report import report
from pipelines.report.session import find

IMAGES = Path(__file__).parents[1] / "images"
DRAWN = "[...exoid.plots.values()].flat().every(u => u.status === 1)"


def picture(
    browser: Browser, page: Path, to: Path, size: tuple[int, int], scheme: str, at: str = "#verdict"
) -> None:
    """Write one picture of a page, from one of its parts on."""
    tab = browser.new_page(
        viewport=dict(zip(("width", "height"), size, strict=True)), color_scheme=scheme
    )
    tab.goto(page.as_uri())
    if at != "#verdict":
        tab.locator(at).evaluate("part => scrollTo({ top: part.offsetTop, behavior: 'instant' })")
    tab.wait_for_timeout(500)
    tab.wait_for_function(DRAWN)
    tab.screenshot(path=to)
    tab.close()


def pictures(session: Path, title: str) -> None:
    """Write all pictures of a session's report."""
    chromium = next(
        filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome")))
    )
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        page, dark, narrow = (
            Path(folder) / name for name in ("report.html", "dark.png", "narrow.png")
        )
        page.write_text(report(find([session]), title), encoding="utf-8")
        args = ["--no-sandbox"] if os.geteuid() == 0 else []
        browser = playwright.chromium.launch(executable_path=chromium, args=args)
        picture(browser, page, IMAGES / "report.png", (1200, 800), "light")
        picture(browser, page, IMAGES / "report-measured.png", (1200, 960), "light", "#measured")
        picture(browser, page, dark, (1200, 800), "dark")
        picture(browser, page, narrow, (390, 800), "light")
        browser.close()
        gap = ones((800, 20, 3))
        imsave(
            IMAGES / "report-dark.png",
            concatenate([imread(dark)[..., :3], gap, imread(narrow)[..., :3]], axis=1),
        )


if __name__ == "__main__":
    pictures(Path(sys.argv[1]), sys.argv[2])
