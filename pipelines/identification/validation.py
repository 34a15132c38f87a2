"""The torque error of a model on validation runs, and its residuals."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipelines.contracts.joints import columns_of, joints_of
from pipelines.errors import InputError
from pipelines.estimation.regression import Regression, regressions, residual_of
from pipelines.mechanics.remedies import AT_REST
from pipelines.mechanics.run import Run
from pipelines.model import Model


@dataclass(frozen=True)
class Score:
    """Torque error of one group of runs, every array (J,) N·m, of J measured joints."""

    rmse: NDArray
    """Away from reversals, as in verdicts."""
    rmse_unmasked: NDArray
    """On every valid sample."""
    torque_rms: NDArray

    def by_joint(self) -> list[dict[str, float]]:
        """Return the errors of each joint for a file's metadata."""
        keys = ("rmse_nm", "rmse_unmasked_nm", "torque_rms_nm")
        errors = np.column_stack([self.rmse, self.rmse_unmasked, self.torque_rms]).tolist()
        return [dict(zip(keys, row, strict=True)) for row in errors]


@dataclass(frozen=True)
class Validation:
    """The torque error on validation runs: pooled, and for each kind of run."""

    joints: tuple[str, ...]
    pooled: Score
    by_run: dict[str, Score]

    def as_json(self) -> dict[str, dict[str, dict[str, float]]]:
        """Return the numbers for a file.

        Returns
        -------
        dict
            By kind of run ("all" pools them), joint, and ``rmse_nm``, ``rmse_unmasked_nm`` or
            ``torque_rms_nm``, N·m.
        """
        scores = self.by_run | {"all": self.pooled}
        return {run: dict(zip(self.joints, s.by_joint(), strict=True)) for run, s in scores.items()}


ModelOf = Callable[[Run], Model | None]
"""Returns the model of a run; None for a kind of run without a model."""


def validate(
    motions: Sequence[Run], model_of: ModelOf, cutoff_hz: float | None = None
) -> Validation:
    """Return the torque error of each run's model, pooled and by kind of run.

    Parameters
    ----------
    motions : sequence of Run
        Validation runs of one machine, at least one.
    model_of : callable
        Return the model of a run, or None: then the run does not count.
    cutoff_hz : float, optional
        Frequencies above do not count, Hz.

    Returns
    -------
    Validation
        RMSE (J,) in N·m, with and without samples near reversals.

    Raises
    ------
    InputError
        If the joints of a kind of run never all move at once.
    """
    joints = motions[0].machine.measured_names
    sums: dict[str, NDArray] = {}
    for motion in motions:
        model = model_of(motion)
        if model is not None:
            # Sums of squares add up over runs and pieces; rms errors do not.
            of_run = sums.get(motion.run, np.zeros((5, len(joints))))
            for r in regressions(motion, model, cutoff_hz):
                of_run = of_run + _sums(r, residual_of(r, model.linear_values))
            sums[motion.run] = of_run
    _refuse_unjudged(motions, sums)
    pooled = sum(sums.values(), np.zeros((5, len(joints))))
    return Validation(
        joints=joints, pooled=_score(pooled), by_run={run: _score(s) for run, s in sums.items()}
    )


def _refuse_unjudged(motions: Sequence[Run], sums: Mapping[str, NDArray]) -> None:
    """Raise InputError where the joints of a kind of run never all move at once."""
    for kind, of_run in sums.items():
        if not of_run[2].any():
            files = ", ".join(motion.file for motion in motions if motion.run == kind)
            raise InputError(
                f"{files}: at no time do all joints move away from reversals, so no torque error"
                f" can be given ({kind}, validate). Validate on a run in which all joints move;"
                f" {AT_REST}"
            )


def _sums(r: Regression, residual: NDArray) -> NDArray:
    """Return sums of squares and their numbers of blocks, (5, J), as ``_score`` takes them."""
    squares, torques = (x[:, r.measured] ** 2 for x in (residual, r.torque))
    ones = np.ones_like(squares)
    # All joints count on the same blocks, so that their errors are comparable.
    scored = [x[r.scored].sum(axis=0) for x in (squares, torques, ones)]
    return np.array([*scored, *(x[r.valid].sum(axis=0) for x in (squares, ones))])


def _score(sums: NDArray) -> Score:
    residual, torque, scored, unmasked, valid = sums
    return Score(
        rmse=_root(residual, scored),
        rmse_unmasked=_root(unmasked, valid),
        torque_rms=_root(torque, scored),
    )


def _root(squares: NDArray, count: NDArray) -> NDArray:
    return np.sqrt(squares / count) if count.any() else np.full(len(squares), np.nan)


def residuals(
    motions: Sequence[Run], model_of: ModelOf, name: str, cutoff_hz: float | None = None
) -> Iterator[pa.Table]:
    """Yield the rows of ``residuals/1``, piece by piece, of all runs with a model.

    Parameters
    ----------
    motions : sequence of Run
    model_of : callable
    name : str
        ``baseline`` or ``extended``.
    cutoff_hz : float, optional
        Frequency above which residuals are removed.
    """
    for motion in motions:
        model = model_of(motion)
        if model is not None:
            for r in regressions(motion, model, cutoff_hz):
                yield _residual_rows(r, motion, model, name)


def _residual_rows(r: Regression, motion: Run, model: Model, name: str) -> pa.Table:
    error = residual_of(r, model.linear_values)
    blocks = len(r.time)
    columns: dict[str, object] = {
        "file": pa.repeat(motion.file, blocks),
        "run": pa.repeat(motion.run, blocks),
        "purpose": pa.repeat(motion.purpose, blocks),
        "segment": r.segment,
        "time_s": r.time,
        "model": pa.repeat(name, blocks),
        "scored": r.scored,
    }
    quantities = {
        "angle": r.state[0],
        "velocity": r.state[1],
        "acceleration": r.state[2],
        "torque": np.where(r.measured, r.torque, np.nan),
        "predicted": np.where(r.measured, r.torque - error, np.nan),
        "residual": np.where(r.measured, error, np.nan),
    }
    return pa.table(columns | columns_of(joints_of(motion.metadata), quantities))
