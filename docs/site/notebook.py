"""A notebook as Markdown, with the output and figures of its cells, run in this process."""

import io
import json
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

from matplotlib import pyplot as plt


def as_markdown(text: str, stem: Path, shown_in: str) -> str:
    """Run a notebook and return it as a page.

    Parameters
    ----------
    text : str
        The notebook, nbformat 4.
    stem : Path
        Where figures go, as ``stem``-1.png, ``stem``-2.png ...
    shown_in : str
        The folder of the figures as the page knows it.
    """
    stem.parent.mkdir(parents=True, exist_ok=True)
    names: dict[str, Any] = {"__name__": "__main__"}
    parts, figures = [], 0
    for cell in json.loads(text)["cells"]:
        code = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(code)
            continue
        parts.append(f"```python\n{code}\n```")
        printed = _run(code, names)
        if printed:
            parts.append(f"```text\n{printed}\n```")
        for number in plt.get_fignums():
            figures += 1
            file = stem.with_name(f"{stem.name}-{figures}.png")
            plt.figure(number).savefig(file, dpi=130, bbox_inches="tight")
            plt.close(number)
            parts.append(f'<img src="{shown_in}/{file.name}" alt="figure of the cell above">')
    return "\n\n".join(parts) + "\n"


def _run(code: str, names: dict[str, Any]) -> str:
    out = io.StringIO()
    with redirect_stdout(out):
        exec(compile(code, "<cell>", "exec"), names)
    return out.getvalue().rstrip()
