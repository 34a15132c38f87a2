"""Adaptive control of the model without and with the named causes, and the sweep of Kv."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipelines.contracts import Joint
from pipelines.contracts.verdict import Verdict
from pipelines.report.charts.chart import Chart, Mark, Panel, Role, Series
from pipelines.report.sections.fit_quality import MODELS, models_of
from pipelines.report.sections.section import Content
from pipelines.report.session import Artifact, Session
from pipelines.workflow.graph import SWEEP

GAIN = "feedback_gain_nm_s_rad"
LIMIT = 4.0
"""Height of a panel in largest settled errors; the start from rest exceeds it."""


def context(content: Content) -> dict[str, Any]:
    """Return the values of the template's part on control."""
    session, verdict = content.session, content.verdict
    return {
        "control": _comparison(verdict) if verdict else None,
        "control_is_compared": "extended" in _loops(session),
        "loops": content.charts.control,
    }


def _comparison(verdict: Verdict) -> dict[str, Any] | None:
    """Return the table of tracking errors and torques; None without a simulated loop."""
    control = verdict.control
    loops = [("without", "rigid body and friction", control.without)]
    if verdict.causes:
        loops.append(("with", "with the causes", control.with_))
    rows = []
    for key, words, loop in loops:
        if loop:
            errors = {joint: 1e3 * value for joint, value in loop.tracking_rmse_rad.items()}
            torque = loop.peak_torque_nm
            rows.append({"key": key, "words": words, "error": errors, "torque": torque})
    if not rows:
        return None
    return {
        "run": (control.run or "").replace("_", " "),
        "joints": list(rows[0]["torque"]),
        "rows": rows,
        "settled_s": (control.controller or {}).get("settled_after_s"),
    }


def _loops(session: Session) -> dict[str, Artifact]:
    """Return one adaptive loop of each model, with a wearer if there are several."""
    results = {}
    for model, simulations in session.simulations_by_model("loop").items():
        kinds = [one.metadata.get("plant", {}).get("run") for one in simulations]
        if kinds and model in models_of(session):
            number = kinds.index("with_human") if "with_human" in kinds else 0
            results[model] = simulations[number]
    return results


def control_charts(session: Session) -> Iterator[Chart]:
    """Yield a chart for each joint, then the chart of the sweep."""
    of_models = _loops(session)
    tables = {model: session.table(one).frame for model, one in of_models.items()}
    if not tables:
        return
    config = next(iter(of_models.values())).metadata.get("config", {})
    settled = config.get("simulate", {}).get("settled_after_s", 0.0)
    for joint in session.joints:
        yield _loop_chart(joint, tables, settled)
    files = {model: one.path.with_name(SWEEP) for model, one in of_models.items()}
    sweep = _sweep_chart(session, files)
    if sweep:
        yield sweep


def _loop_chart(joint: Joint, tables: dict[str, pd.DataFrame], settled: float) -> Chart:
    first = next(iter(tables.values()))
    angles, errors, torques, worst = [], [], [], 0.0
    for model, frame in tables.items():
        # A loop of another length cannot share the chart's time.
        if len(frame) != len(first):
            continue
        role, words = MODELS[model]
        error = 1e3 * frame[joint.column("error")].to_numpy()
        worst = max(worst, float(np.abs(error[frame["time_s"] >= settled]).max(initial=0.0)))
        angles.append(Series(words, frame[joint.column("angle")].to_numpy(), role))
        errors.append(Series(words, error, role))
        torques.append(Series(words, frame[joint.column("torque")].to_numpy(), role))
    angles.append(Series("wanted", first[joint.column("reference")].to_numpy(), Role.WANTED))
    unit = joint.unit("angle")
    return Chart(
        key=f"control-{joint.name}",
        title=f"{joint.name} under adaptive RBF control",
        caption=f"From rest; errors count from {settled:g} s on, when the network has adapted.",
        x_label="time, s",
        x=first["time_s"].to_numpy(),
        panels=(
            Panel(f"angle, {unit}", tuple(angles)),
            # A height of zero is no range, so it becomes None.
            Panel(f"error, m{unit}", tuple(errors), reach=LIMIT * worst or None),
            Panel(f"torque, {joint.unit('torque')}", tuple(torques)),
        ),
        group="control",
    )


def _sweep_chart(session: Session, files: dict[str, Path]) -> Chart | None:
    columns = {GAIN, *(joint.column("error") for joint in session.joints)}
    tables: dict[str, pd.DataFrame] = {}
    for model, path in files.items():
        table = pd.read_csv(path) if path.is_file() else pd.DataFrame()
        if columns <= set(table.columns) and len(table):
            tables[model] = table
    if not tables:
        return None
    first = next(iter(tables.values()))
    panels = []
    for joint in session.joints:
        curves = []
        for model, table in tables.items():
            # Curves share x, so both sweeps must have the same gains.
            if table[GAIN].equals(first[GAIN]):
                role, words = MODELS[model]
                errors = 1e3 * table[joint.column("error")].to_numpy(dtype=float)
                curves.append(Series(words, errors, role, Mark.MEAN))
        panels.append(Panel(f"{joint.name}, m{joint.unit('angle')}", tuple(curves)))
    return Chart(
        key="kv-sweep",
        title="Largest settled error against the feedback gain",
        caption="One simulation per gain.",
        x_label="feedback gain Kv, N·m·s/rad",
        x=first[GAIN].to_numpy(dtype=float),
        panels=tuple(panels),
    )
