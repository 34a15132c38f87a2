"""Adaptive control of the model without and with the named causes, and the sweep of Kv."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from pipelines.contracts import Joint
from pipelines.contracts.verdict import Verdict
from pipelines.plotting.chart import Chart
from pipelines.plotting.simulation_panels import GAIN, loop_panels, sweep_panel
from pipelines.report.sections.fit_quality import drawn, models_of
from pipelines.report.session import Artifact, Session
from pipelines.workflow.graph import SWEEP


def comparison(verdict: Verdict) -> dict[str, Any] | None:
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


def loops_of(session: Session) -> dict[str, Artifact]:
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
    of_models = loops_of(session)
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
    loops = [drawn(model, table) for model, table in tables.items()]
    return Chart(
        key=f"control-{joint.name}",
        title=f"{joint.name} under adaptive RBF control",
        caption=f"From rest; errors count from {settled:g} s on, when the network has adapted.",
        x_label="time, s",
        x=loops[0].rows["time_s"].to_numpy(),
        panels=loop_panels(joint, loops, settled),
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
    sweeps = [
        drawn(model, table)
        for model, table in tables.items()
        # Curves share x, so all sweeps must have the same gains.
        if table[GAIN].equals(first[GAIN])
    ]
    return Chart(
        key="kv-sweep",
        title="Largest settled error against the feedback gain",
        caption="One simulation per gain.",
        x_label="feedback gain Kv, N·m·s/rad",
        x=first[GAIN].to_numpy(dtype=float),
        panels=tuple(sweep_panel(joint, sweeps) for joint in session.joints),
    )
