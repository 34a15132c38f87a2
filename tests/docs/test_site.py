"""The site of docs/ builds without a warning, holds every page, and asks no network for
anything."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
DRAWN = "cogging"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Return the site as `make docs` makes it, with the signature of one effect only: all of them
    take a minute."""
    folder = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "--quiet",
        "--fail-on-warning",
        "--keep-going",
        "-c",
        DOCS / "site",
    ]
    drawn = ["-D", f"gallery_effects={DRAWN}", "-d", folder / "doctrees"]
    done = subprocess.run(
        [*command, *drawn, DOCS, folder / "html"], capture_output=True, text=True, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
    return folder / "html"


class Asked(HTMLParser):
    """What a browser asks for to show a page."""

    def __init__(self):
        super().__init__()
        self.places = []

    def handle_starttag(self, tag, attributes):
        name = {"img": "src", "script": "src", "link": "href"}.get(tag)
        self.places += [value for key, value in attributes if key == name]


def test_every_page_is_there_and_nothing_is_asked_of_a_network(site):
    for source in [*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")]:
        page = site / source.relative_to(DOCS).with_suffix(".html")
        asked = Asked()
        asked.feed(page.read_text(encoding="utf-8"))
        assert asked.places
        for place in asked.places:
            assert "//" not in place, f"{page.name} asks for {place}"
            assert (page.parent / place.partition("?")[0]).exists(), f"{page.name} lacks {place}"


def test_the_site_opens_by_its_folder(site):
    assert (site / "index.html").read_bytes() == (site / "README.html").read_bytes()


def test_an_effect_shows_the_signature_that_was_drawn_for_it(site):
    page = (site / "effects" / f"{DRAWN}.html").read_text(encoding="utf-8")
    assert f"../_signatures/{DRAWN}.png" in page
    assert [path.stem for path in (site / "_signatures").iterdir()] == [DRAWN]


def test_equations_are_drawn_not_left_as_latex(site):
    page = (site / "science.html").read_text(encoding="utf-8")
    source = (DOCS / "science.md").read_text(encoding="utf-8")
    assert page.count('<div class="equation"><svg') == source.count("$$") // 2 > 10
    heights = [float(height) for height in re.findall(r'<svg [^>]*?height="([\d.]+)"', page)]
    assert max(heights) < 120, "a bracket that grows without end"
    assert not re.search(r"\$\$|\\frac", re.sub(r'(?:aria-label|title)="[^"]*"', "", page))
