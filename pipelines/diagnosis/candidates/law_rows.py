"""Rows of the smooth laws and of the curves of time in the decision regression."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.smooth_laws import (
    IN_CUFFS,
    LawColumn,
    Spans,
    curves_of_time,
    smooth_laws,
)
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression
from pipelines.diagnosis.evidence.prepared_runs import Prepared


def law_rows(prepared: Prepared, regression: DecisionRegression) -> tuple[list[LawColumn], NDArray]:
    """Return every smooth law and its rows (N, l)."""
    joints = regression.joints
    spans = Spans.of(prepared.runs, prepared.torque[:joints])
    drives, laws = [], []
    for run, columns in zip(prepared.runs, prepared.columns, strict=True):
        laws, values = smooth_laws(run, spans, (columns @ prepared.values)[:, :joints])
        drives.append(values * spans.torque[:, np.newaxis])
    zero = [np.zeros_like(x) for x in drives]
    worn = [x * (run.motion.run == "with_human") for x, run in zip(drives, prepared.runs, strict=True)]
    felt = bool(np.isfinite(prepared.noise.density[joints:]).any())
    kinds = {run.motion.run for run in prepared.runs}
    parts = [(list(laws), _both(drives, zero))]
    if "with_human" in kinds and (len(kinds) == 2 or felt):
        parts.append(([replace(law, wearer="human") for law in laws], _both(worn, worn)))
    if felt:
        chosen = [i for i, law in enumerate(laws) if law.kind in IN_CUFFS]
        own = [replace(laws[i], wearer="cuffs") for i in chosen]
        parts.append((own, [x[:, :, chosen] for x in _both(zero, worn)]))
    rows = [regression.project(regression.rows(columns)) for _, columns in parts]
    return [law for some, _ in parts for law in some], np.hstack(rows)


def _both(drives: Sequence[NDArray], cuffs: Sequence[NDArray]) -> list[NDArray]:
    """Put columns of drives and of cuffs, (m, J, k) each, over one another."""
    return [np.concatenate([d, c], axis=1) for d, c in zip(drives, cuffs, strict=True)]


def curve_rows(prepared: Prepared, regression: DecisionRegression) -> tuple[list[tuple[int, int, float]], NDArray]:
    """Return joint, run and prior variance of every curve of time, and their rows (N, t)."""
    told, rows = [], []
    for r, run in enumerate(prepared.runs):
        curves, variance = curves_of_time(run)
        for j in range(regression.joints):
            parts = [np.zeros((*other.measured.shape, len(variance))) for other in prepared.runs]
            parts[r][:, j] = curves * prepared.torque[j]
            told += [(j, r, float(v)) for v in variance]
            rows.append(regression.project(regression.rows(parts)))
    return told, np.hstack(rows)
