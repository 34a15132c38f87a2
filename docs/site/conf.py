"""How Sphinx makes the site of docs/ (`make docs`), without a network."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

project = "exoid"
author = "the exoid contributors"
root_doc = "README"
source_suffix = {".md": "markdown", ".ipynb": "markdown"}
exclude_patterns = ["site"]
extensions = ["myst_parser", "sphinx_copybutton", "navigation", "equations", "gallery", "examples"]

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
copybutton_exclude = ".linenos, .gp, .go"

html_theme = "furo"
html_title = "exoid"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "drawn"
html_copy_source = False
html_show_copyright = False
