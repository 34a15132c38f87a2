"""The examples on the site: scripts as they are, notebooks with their output and figures."""

import re
from pathlib import Path

from notebook import as_markdown
from sphinx.application import Sphinx

SCRIPT = re.compile(r"\]\((\w+\.py)\)")
FOLDER = "_notebooks"


def add_sources(app: Sphinx, docname: str, source: list[str]) -> None:
    """Append each script to the list of examples, and let the list's links lead there."""
    if docname == "examples/README":
        page = Path(app.srcdir) / "examples"
        scripts = SCRIPT.findall(source[0])
        listed = SCRIPT.sub(lambda link: f"](#{_anchor(link[1])})", source[0])
        shown = [
            f"## {name}\n\n```python\n{(page / name).read_text(encoding='utf-8')}```\n"
            for name in scripts
        ]
        notebooks = sorted(path.stem for path in page.glob("*.ipynb"))
        source[0] = "\n".join(
            [listed, *shown, "```{toctree}", ":hidden:", "", *notebooks, "```", ""]
        )


def _anchor(name: str) -> str:
    return name.replace(".", "")


def run_notebook(app: Sphinx, docname: str, source: list[str]) -> None:
    """Add the output and figures of a notebook's cells."""
    if Path(app.env.doc2path(docname)).suffix == ".ipynb":
        folder = Path(app.outdir) / FOLDER
        source[0] = as_markdown(source[0], folder / Path(docname).name, f"../{FOLDER}")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", add_sources)
    app.connect("source-read", run_notebook)
    return {"parallel_read_safe": True}
