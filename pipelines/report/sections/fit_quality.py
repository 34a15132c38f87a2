"""Measured and simulated torque and angle of whole runs, without and with the causes."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts import Joint
from pipelines.plotting.chart import Chart, DrawnTable, Role
from pipelines.plotting.residual_panels import torque_panels
from pipelines.plotting.simulation_panels import window_panels
from pipelines.report.session import Artifact, Session
from pipelines.wording.increased_errors import simulation_error_grew, torque_error_grew

MODELS = {
    "baseline": (Role.BEFORE, "rigid body and friction"),
    "extended": (Role.AFTER, "with the causes"),
}
"""Role and legend of the models of ``residuals/1``."""


def run_names(session: Session) -> list[str]:
    """Return the runs that have residuals, validation runs first."""
    if session.residuals is None:
        return []
    runs = session.residuals.frame[["file", "purpose"]].drop_duplicates("file")
    # Descending, as train comes before validate in the alphabet; stable within each.
    return list(runs.sort_values("purpose", ascending=False, kind="stable")["file"])


def models_of(session: Session) -> dict[str, tuple[Role, str]]:
    """Return the models to draw: without a named cause, the baseline only."""
    named = session.verdict is None or bool(session.causes)
    return {name: title for name, title in MODELS.items() if named or name == "baseline"}


def drawn(model: str, rows: pd.DataFrame) -> DrawnTable:
    """Return rows of a model, to be drawn in its role."""
    role, words = MODELS[model]
    return DrawnTable(words, role, rows)


def torque_charts(session: Session) -> Iterator[Chart]:
    """Yield a chart for each run and joint: torque, and the residual of each model."""
    for run in run_names(session):
        rows = residuals_of(session, run)
        measured = rows[rows["model"] == rows["model"].iloc[0]]
        models = [drawn(model, rows[rows["model"] == model]) for model in models_of(session)]
        for joint in session.measured_joints:
            floor = session.noise_floor(joint)
            yield Chart(
                key=f"torque-{run.removesuffix('.parquet')}-{joint.name}",
                title=f"{joint.name} {joint.effort}",
                caption=(
                    "Measured and computed from the motion, in the blocks that were fitted; below,"
                    " each model's error away from reversals"
                    f"{', on the band of the noise floor' if floor else ''}."
                ),
                x_label="time, s",
                x=measured["time_s"].to_numpy(),
                panels=torque_panels(joint, measured, models, floor),
                group=run,
            )


def residuals_of(session: Session, run: str) -> pd.DataFrame:
    """Return the residuals of a run; no rows if it has none."""
    if session.residuals is None:
        return pd.DataFrame({"file": []})
    frame = session.residuals.frame
    return frame[frame["file"] == run]


def angle_charts(session: Session) -> Iterator[Chart]:
    """Yield a chart of simulated angles for each replayed run and joint."""
    for run, files in replayed(session).items():
        replays = [drawn(model, session.table(one).frame) for model, one in files.items()]
        for joint in session.joints:
            yield Chart(
                key=f"angle-{run.removesuffix('.parquet')}-{joint.name}",
                title=f"{joint.name} {joint.place} in simulations of one second",
                caption=(
                    f"Each second the model starts from the measured state and receives the"
                    f" recorded {joint.effort}; below, its error."
                ),
                x_label="time, s",
                x=replays[0].rows["time_s"].to_numpy(),
                panels=window_panels(joint, replays),
                group=run,
            )


def replayed(session: Session, kind: str = "windows") -> dict[str, dict[str, Artifact]]:
    """Return the replays of a kind (see ``session.simulation_kind``), by run and drawn model."""
    results: dict[str, dict[str, Artifact]] = {}
    drawn = models_of(session)
    for model, replays in session.simulations_by_model(kind).items():
        for one in replays if model in drawn else ():
            source = session.recorded(one)
            # The inputs of a replay are the model and, last, the recording.
            run = source.path.name if source else one.inputs[-1]["name"]
            results.setdefault(run, {}).setdefault(model, one)
    return results


@dataclass(frozen=True)
class Score:
    """One error of a run, for each model."""

    words: str
    values: tuple[float | None, ...]
    """One per model, in the order of ``MODELS``; None if there is no such replay."""
    note: str = ""
    """Remark on the row, in few words."""


def scores(session: Session, run: str) -> list[Score]:
    """Return the errors of each model in a run: computed torque, then replays."""
    joints = session.measured_joints
    results = [score for joint in joints for score in _torque_scores(session, run, joint)]
    # For each kind of replay: metadata key, quantity, words, factor and prefix of the unit.
    kinds = {
        "windows": (("simulation_rmse_rad", "angle", "1 s under the recorded {drive}", 1e3, "m"),),
        "drives": (
            ("closed_loop_rmse_rad", "angle", "in the drives' own loop", 1e3, "m"),
            ("closed_loop_rmse_nm", "torque", "in the drives' own loop", 1.0, ""),
        ),
    }
    for kind, rows in kinds.items():
        replays = replayed(session, kind).get(run, {})
        shown = [replays.get(model) for model in models_of(session)]
        for key, quantity, words, factor, prefix in rows if replays else ():
            for joint in session.joints:
                values = tuple(_stated_error(replay, key, joint, factor) for replay in shown)
                name = joint.place if quantity == "angle" else joint.effort
                how, unit = words.format(drive=joint.effort), f"{prefix}{joint.unit(quantity)}"
                where = f"{joint.name} {name}, {how}, {unit}"
                note = _note(simulation_error_grew(*values))
                results.append(Score(where, values, note))
                if kind == "windows":
                    results += _while_moving(session, replays, joint, where)
    return [score for score in results if any(value is not None for value in score.values)]


def _note(grew: bool) -> str:
    return "larger with the causes" if grew else ""


def _stated_error(replay: Artifact | None, key: str, joint: Joint, factor: float) -> float | None:
    value = replay.metadata.get(key, {}).get(joint.name) if replay else None
    return None if value is None else factor * value


def _torque_scores(session: Session, run: str, joint: Joint) -> Iterator[Score]:
    """Yield a run's rms torque error away from reversals, and in all blocks that were fitted."""
    rows = residuals_of(session, run)
    if not len(rows):
        return
    floor = session.noise_floor(joint)
    grew_away_from_reversals = False
    # In this order, as the second note depends on the first result.
    subsets = {"away from reversals": rows[rows["scored"]], "reversals included": rows}
    residual = joint.column("residual")
    for words, chosen in subsets.items():
        errors = [chosen.loc[chosen["model"] == model, residual] for model in models_of(session)]
        values = tuple(float(np.sqrt(np.mean(e**2))) if len(e) else None for e in errors)
        grew = floor is not None and torque_error_grew(*values, floor=floor)
        note = _note(grew)
        if grew and words == "reversals included" and not grew_away_from_reversals:
            note += (
                "; only near reversals: a model of speed cannot predict the torque that holds a"
                " standing joint"
            )
        label = f"{joint.name} {joint.effort}, computed, {words}, {joint.unit('torque')}"
        yield Score(label, values, note)
        grew_away_from_reversals = grew


def _while_moving(
    session: Session, replays: dict[str, Artifact], joint: Joint, where: str
) -> Iterator[Score]:
    """Yield the error in the windows without standstill, if there are windows of both kinds."""
    values: list[float | None] = []
    kept = of = 0
    for model in models_of(session):
        values.append(None)
        if model in replays:
            frame = session.table(replays[model]).frame
            chosen = frame[moving(frame, joint)]
            if len(chosen):
                # mrad, or mm at a prismatic joint.
                values[-1] = 1e3 * float(np.sqrt(np.mean(chosen[joint.column("error")] ** 2)))
                kept, of = chosen["window"].nunique(), frame["window"].nunique()
    # If all windows count, or none, the row would repeat another or be empty.
    if 0 < kept < of:
        yield Score(f"{where}: of these the {kept} of {of} in which it never stands", tuple(values))


def moving(frame: pd.DataFrame, joint: Joint) -> NDArray[np.bool_]:
    """Return whether the measured joint moved throughout the window of each row.

    Parameters
    ----------
    frame : DataFrame of n rows
        A replay: ``time_s``, ``window``, and the measured angle as reference.
    joint : Joint

    Returns
    -------
    (n,) array of bool
    """
    time, place = (frame[name].to_numpy() for name in ("time_s", joint.column("reference")))
    windows = frame["window"].to_numpy()
    # Speed is measured over 0.1 s, so that encoder noise does not count as motion.
    span = max(1, round(0.1 / float(np.median(np.diff(time)))))
    moved, within = place[span:] - place[:-span], windows[span:] == windows[:-span]
    # Share of its rms speed below which a joint counts as standing.
    slow_share = 0.1
    slow = np.abs(moved) < slow_share * np.sqrt(np.mean(moved[within] ** 2))
    # One slow stretch excludes its whole window, whose error lasts to the window's end.
    return ~np.isin(windows, windows[span:][within & slow])
