"""The gallery of effects: their signatures, drawn by the code of now while the site is built.

The pages in docs/effects stay plain Markdown; figures are added to them here.
"""

from pathlib import Path

import signatures
from signatures import draw, ours
from sphinx.application import Sphinx
from sphinx.util.display import status_iterator

ROOT = Path(__file__).parents[2]
FOLDER = "_signatures"


def draw_signatures(app: Sphinx) -> None:
    """Draw what is missing, or older than the code, in the site's folder."""
    folder = Path(app.outdir) / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    code = [
        *ROOT.glob("pipelines/**/*.py"),
        ROOT / "tests" / "effects" / "catalogue.py",
        Path(signatures.__file__),
    ]
    changed = max(path.stat().st_mtime for path in code)
    stale = [
        e for e in ours() if _chosen(app, e.name) and not _newer(folder / f"{e.name}.png", changed)
    ]
    for effect in status_iterator(
        stale, "drawing signatures... ", length=len(stale), stringify_func=lambda e: e.name
    ):
        draw(effect, folder / effect.name)


def _newer(path: Path, changed: float) -> bool:
    return path.exists() and path.stat().st_mtime > changed


def _chosen(app: Sphinx, name: str) -> bool:
    return not app.config.gallery_effects or name in app.config.gallery_effects


def add_figures(app: Sphinx, docname: str, source: list[str]) -> None:
    """Put an effect's signature below what it looks like, and all of them on the index."""
    if docname == "effects/README":
        source[0] += "\n" + _index(app)
    elif docname.startswith("effects/"):
        name = docname.removeprefix("effects/")
        if _chosen(app, name):
            head, looks, rest = source[0].partition("**Looks like:**")
            text, end, tail = rest.partition("\n\n")
            source[0] = f"{head}{looks}{text}\n\n{_image(name)}\n\n{CAPTION}{end}{tail}"


CAPTION = """*The residual of rigid body and friction on a quiet virtual leg that has this effect:
a run with a wearer, fitted together with one of the machine alone.*"""


def _image(name: str) -> str:
    return (
        f'<img class="signature" src="../{FOLDER}/{name}.png" alt="The residual that {name}'
        ' causes" loading="lazy">'
    )


def _index(app: Sphinx) -> str:
    names = [effect.name for effect in ours()]
    shown = [f'<a href="{name}.html">{_image(name)}</a>' for name in names if _chosen(app, name)]
    pages = ["```{toctree}", ":hidden:", "", *names, "```"]
    return "\n".join(
        ["## Their signatures", "", '<div class="gallery">', *shown, "</div>", "", *pages, ""]
    )


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.add_config_value(
        "gallery_effects", [], "html", description="Effects to draw; all where none is named."
    )
    app.connect("builder-inited", draw_signatures)
    app.connect("source-read", add_figures)
    return {"parallel_read_safe": True}
