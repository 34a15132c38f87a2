"""One HTML file that holds its style, scripts and data; texts from files never run as scripts."""

import base64
import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.resources import files
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from pipelines import __version__
from pipelines.contracts import describe
from pipelines.contracts.provenance import sha256
from pipelines.plotting.chart import Chart, Series
from pipelines.report.sections.animation import Animation
from pipelines.report.session import Artifact
from pipelines.wording.numbers import digits, digits_for
from pipelines.workflow.graph import SWEEP


def render(
    template: str,
    charts: Iterable[Chart],
    animations: Iterable[Animation],
    context: Mapping[str, Any],
    artifacts: Iterable[Artifact],
) -> str:
    """Return a page as text; every text of ``context`` is escaped."""
    # Inside the page, which must open without a network.
    style = _asset("uPlot.min.css") + _asset("page.css")
    scripts = [_asset("sharp.js"), _asset("uPlot.iife.min.js"), _asset("page.js")]
    data = {
        "charts": {chart.key: _chart(chart) for chart in charts},
        "animations": [_animation(one) for one in animations],
    }
    page = _environment().get_template(template)
    return page.render(
        context,
        style=Markup(style),
        style_hash=_digest(style),
        scripts=[Markup(script) for script in scripts],
        script_hashes=[_digest(script) for script in scripts],
        data=Markup(_in_a_script(data)),
        provenance=Markup(_in_a_script(_provenance(artifacts))),
        uplot_version=_uplot_version(_asset("uPlot.iife.min.js")),
        uplot_license=Markup(_asset("uPlot.LICENSE")),
        version=__version__,
        made=f"Made by exoid {__version__} on {datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
    )


def _provenance(artifacts: Iterable[Artifact]) -> dict[str, Any]:
    """Return the page's inputs, as in the metadata of every file of exoid."""
    artifacts = list(artifacts)
    inputs = [{"name": one.path.name, "sha256": one.sha256} for one in artifacts]
    # The sweep is a table without metadata, in the folder of its model's loop.
    loops = [one.path for one in artifacts if one.kind == "simulation"]
    sweeps = dict.fromkeys(path.with_name(SWEEP) for path in loops)
    inputs += [{"name": file.name, "sha256": sha256(file)} for file in sweeps if file.is_file()]
    return describe() | {"inputs": inputs}


@cache
def _asset(name: str) -> str:
    """Return a file of the page."""
    return files("pipelines.report").joinpath("assets", name).read_text(encoding="utf-8")


@cache
def _environment() -> jinja2.Environment:
    # Strict: a value that a section forgot raises an error instead of leaving a blank.
    loader, undefined = jinja2.FunctionLoader(_asset), jinja2.StrictUndefined
    environment = jinja2.Environment(loader=loader, undefined=undefined, autoescape=True)
    environment.trim_blocks = environment.lstrip_blocks = True
    environment.filters |= {"digits": digits, "digits_for": digits_for}
    return environment


def _digest(text: str) -> str:
    """Return the hash that allows an inline script or style in a content security policy."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def _uplot_version(script: str) -> str:
    match = re.search(r"uPlot \(v([\d.]+)\)", script)
    assert match
    return match[1]


def _in_a_script(data: Any) -> str:
    """Return JSON in which no text can end the script element."""
    # A session's names may hold `</script>`, which would end the element inside a string.
    text = json.dumps(data, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _chart(chart: Chart) -> dict[str, Any]:
    return {
        "x_label": chart.x_label,
        # In float32 an hour has steps of 0.24 ms, which show in a zoomed chart.
        "x": _coded(chart.x, np.float64),
        "group": chart.group,
        "panels": [
            {
                "label": panel.label,
                "band": panel.band,
                "reach": panel.reach,
                "series": [_series(one) for one in panel.series],
            }
            for panel in chart.panels
        ],
    }


def _series(one: Series) -> dict[str, Any]:
    about = {"label": one.label, "role": one.role, "mark": one.mark}
    return about | {"values": _coded(one.values, np.float32)}


def _animation(one: Animation) -> dict[str, Any]:
    return {
        "kind": one.kind,
        "lengths": one.lengths,
        "time": _coded(one.time, np.float64),
        "angles": {role: _coded(values, np.float32) for role, values in one.angles.items()},
    }


def _coded(values: NDArray, dtype: type[np.floating]) -> str:
    """Return numbers, (n,) or (n, k), as base64 of their little-endian bytes, row by row."""
    # The page's typed arrays read the bytes as they are, in the order of its computer.
    little_endian = np.ascontiguousarray(values, np.dtype(dtype).newbyteorder("<"))
    return base64.b64encode(little_endian.tobytes()).decode()
