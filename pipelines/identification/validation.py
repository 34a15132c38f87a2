"""How well a model predicts the torque of runs that no fit has seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.joints import joints_of
from pipelines.estimation.least_squares import residual_of
from pipelines.estimation.regression import regress
from pipelines.mechanics.motion import Motion
from pipelines.model import Model


@dataclass(frozen=True)
class Score:
    """Torque error of one group of runs, every array (J,) N·m."""

    rmse: NDArray
    """Away from reversals, as verdicts count it."""
    rmse_unmasked: NDArray
    """On every valid sample."""
    torque_rms: NDArray
    samples: int
    """Blocks that ``rmse`` counts."""


@dataclass(frozen=True)
class Validation:
    """The torque error on validation runs: pooled, and for each kind of run."""

    joints: tuple[str, ...]
    pooled: Score
    by_run: dict[str, Score]

    def as_json(self) -> dict[str, dict[str, dict[str, float]]]:
        """Return the numbers by kind of run ("all" pools them) and joint, N·m."""
        return {
            run: {
                joint: {
                    "rmse_nm": float(score.rmse[j]),
                    "rmse_unmasked_nm": float(score.rmse_unmasked[j]),
                    "torque_rms_nm": float(score.torque_rms[j]),
                }
                for j, joint in enumerate(self.joints)
            }
            for run, score in {**self.by_run, "all": self.pooled}.items()
        }


def validate(motions: Sequence[Motion], models: Mapping[str, Model]) -> Validation:
    """Score each kind of run's model on its motions; runs of a kind that has no model are left out."""
    tables = {run: [_errors(m, models[run]) for m in motions if m.run == run] for run in models}
    tables = {run: found for run, found in tables.items() if found}
    return Validation(
        joints=motions[0].joints,
        pooled=_score([errors for found in tables.values() for errors in found]),
        by_run={run: _score(found) for run, found in tables.items()},
    )


_Errors = tuple[NDArray, NDArray, NDArray, NDArray]
"""Residual and torque (m, J), which blocks are scored and which are valid (m,)."""


def _errors(motion: Motion, model: Model) -> _Errors:
    r = regress(motion, model)
    return residual_of(r, model.linear_values), r.torque, r.scored, r.valid


def _score(tables: Sequence[_Errors]) -> Score:
    residual, torque, scored, valid = (np.concatenate(arrays) for arrays in zip(*tables, strict=True))
    return Score(
        rmse=_rms(residual[scored]),
        rmse_unmasked=_rms(residual[valid]),
        torque_rms=_rms(torque[scored]),
        samples=int(scored.sum()),
    )


def _rms(x: NDArray) -> NDArray:
    return np.sqrt(np.mean(x**2, axis=0)) if len(x) else np.full(x.shape[1], np.nan)


def residuals(motion: Motion, model: Model, name: str) -> pd.DataFrame:
    """Return a run's rows of ``residuals/1``; ``name`` is ``baseline`` or ``extended``."""
    r = regress(motion, model)
    error = residual_of(r, model.linear_values)
    columns: dict[str, object] = {
        "file": np.full(len(r.time), motion.file),
        "run": motion.run,
        "purpose": motion.purpose,
        "segment": r.segment,
        "time_s": r.time,
        "model": name,
        "scored": r.scored,
    }
    quantities = {
        "angle": r.state[0],
        "velocity": r.state[1],
        "acceleration": r.state[2],
        "torque": r.torque,
        "predicted": r.torque - error,
        "residual": error,
    }
    for j, joint in enumerate(joints_of(motion.metadata)):
        columns |= {joint.column(quantity): values[:, j] for quantity, values in quantities.items()}
    return pd.DataFrame(columns)
