"""The site's navigation: the sections of docs/README.md, and the pages that their tables link to.

So a page is listed once, for readers of the repository too. A page that is not listed is an error.
"""

import re
import shutil
from pathlib import Path

from sphinx.application import Sphinx

LINK = re.compile(r"\]\(([\w/.-]+)\.md\)")
NAMED_BY_FILE = re.compile(r"\[([\w-]+\.md)\]\(\1\)")
OUTSIDE = re.compile(r"\[([^\]]+)\]\((?:\.\./)+(?:tests|datasets|pipelines|exoid_cli)/[^)]*\)")


def pages_of(section: str) -> list[str]:
    """Return the pages that a section links to, in its order, each once."""
    return list(dict.fromkeys(LINK.findall(section)))


def toctrees(text: str) -> str:
    """Return a hidden table of contents for each section of an index."""
    trees = []
    for section in text.split("\n## ")[1:]:
        caption, _, body = section.partition("\n")
        trees += [
            "```{toctree}",
            ":hidden:",
            f":caption: {caption}",
            "",
            *pages_of(body),
            "```",
            "",
        ]
    return "\n".join(trees)


def add_toctrees(app: Sphinx, docname: str, source: list[str]) -> None:
    """Append the navigation to the index, and let it call pages by their titles."""
    if docname == app.config.root_doc:
        source[0] = NAMED_BY_FILE.sub(r"[](\1)", source[0]) + "\n" + toctrees(source[0])


def leave_out_links_to_code(app: Sphinx, docname: str, source: list[str]) -> None:
    """Keep only the text of links out of docs/, so that the site works by itself."""
    source[0] = OUTSIDE.sub(r"\1", source[0])


def front_page(app: Sphinx, exception: Exception | None) -> None:
    """Let the site open by its folder, as browsers and servers expect."""
    if exception is None:
        shutil.copyfile(
            Path(app.outdir) / f"{app.config.root_doc}.html", Path(app.outdir) / "index.html"
        )


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", add_toctrees)
    app.connect("source-read", leave_out_links_to_code)
    app.connect("build-finished", front_page)
    return {"parallel_read_safe": True}
