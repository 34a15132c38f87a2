"""Measured beside simulated over whole runs, before and after the causes are named."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts import Joint
from pipelines.report.chart import Chart, Panel, Role, Series
from pipelines.report.session import Artifact, Session

MODELS = {"baseline": (Role.BEFORE, "rigid body and friction"), "extended": (Role.AFTER, "with the causes")}
"""The models of ``residuals/1``, and how charts call them."""


def run_names(session: Session) -> list[str]:
    """Return the runs that have residuals, validation runs first."""
    if session.residuals is None:
        return []
    runs = session.residuals.frame[["file", "purpose"]].drop_duplicates("file")
    return list(runs.sort_values("purpose", ascending=False, kind="stable")["file"])


def models_of(session: Session) -> dict[str, tuple[Role, str]]:
    """Return the models to be drawn: a diagnosis that names nothing has only one."""
    named = session.verdict is None or bool(session.verdict["causes"])
    return {name: told for name, told in MODELS.items() if named or name == "baseline"}


def torque_charts(session: Session) -> Iterator[Chart]:
    """Yield a chart for each run and joint: torque, and what each model leaves of it."""
    if session.residuals is None:
        return
    frame, floors = session.residuals.frame, (session.verdict or {}).get("noise_floor_nm", {})
    for run in run_names(session):
        of_run = frame[frame["file"] == run]
        for joint in session.joints:
            yield _torque_chart(session, run, joint, of_run, floors.get(joint.name))


def _torque_chart(session: Session, run: str, joint: Joint, frame: pd.DataFrame, floor: float | None) -> Chart:
    quantity, unit = ("force" if joint.kind == "prismatic" else "torque"), joint.unit("torque")
    first = frame[frame["model"] == frame["model"].iloc[0]]
    torques, errors = [], []
    for model, (role, words) in models_of(session).items():
        rows = frame[frame["model"] == model]
        if len(rows) != len(first):
            continue
        torques.append(Series(words, rows[joint.column("predicted")].to_numpy(), role))
        left = rows[joint.column("residual")].where(rows["scored"]).to_numpy()
        errors.append(Series(words, left, role))
    torques.append(Series("measured", first[joint.column("torque")].to_numpy(), Role.MEASURED))
    return Chart(
        key=f"torque-{_stem(run)}-{joint.name}",
        title=f"{joint.name} {quantity}",
        caption=f"Measured and computed from the motion, in the blocks that were fitted; below, what each model leaves "
        f"away from reversals{', on the band of the noise floor' if floor else ''}.",
        x_label="time, s",
        x=first["time_s"].to_numpy(),
        panels=(
            Panel(f"{quantity}, {unit}", tuple(torques)),
            Panel(f"error, {unit}", tuple(errors), band=floor),
        ),
        group=run,
    )  # fmt: skip


def angle_charts(session: Session) -> Iterator[Chart]:
    """Yield a chart for each replayed run and joint: the angle in simulations of a second under the recorded torque."""
    for run, replays in replayed(session).items():
        tables = {model: session.table(one).frame for model, one in replays.items()}
        for joint in session.joints:
            yield _angle_chart(run, joint, tables)


def replayed(session: Session) -> dict[str, dict[str, Artifact]]:
    """Return the replays in windows, by run and model."""
    found: dict[str, dict[str, Artifact]] = {}
    for model, replays in session.simulations_by_model("windows").items():
        for one in replays:
            source = session.recorded(one)
            run = source.path.name if source else one.inputs[-1]["name"]
            found.setdefault(run, {}).setdefault(model, one)
    return found


def _angle_chart(run: str, joint: Joint, tables: dict[str, pd.DataFrame]) -> Chart:
    first = next(iter(tables.values()))
    where = "position" if joint.kind == "prismatic" else "angle"
    angles, errors = [], []
    for model, frame in tables.items():
        if len(frame) != len(first):
            continue
        role, words = MODELS[model]
        angles.append(Series(words, broken(frame, joint.column("angle")), role))
        errors.append(Series(words, 1e3 * broken(frame, joint.column("error")), role))
    angles.append(Series("measured", first[joint.column("reference")].to_numpy(), Role.MEASURED))
    unit = joint.unit("angle")
    return Chart(
        key=f"angle-{_stem(run)}-{joint.name}",
        title=f"{joint.name} {where} in simulations of one second",
        caption=f"Each second the model starts where the machine was and gets the recorded "
        f"{'force' if joint.kind == 'prismatic' else 'torque'}; below, how far it strays.",
        x_label="time, s",
        x=first["time_s"].to_numpy(),
        panels=(Panel(f"{where}, {unit}", tuple(angles)), Panel(f"error, m{unit}", tuple(errors))),
        group=run,
    )


def broken(frame: pd.DataFrame, column: str) -> NDArray:
    """Return a column (n,) with a gap where a window begins: no line may join two simulations."""
    begins = frame["window"].diff().fillna(0) != 0
    return frame[column].where(~begins, np.nan).to_numpy()


def _stem(run: str) -> str:
    return run.removesuffix(".parquet")
