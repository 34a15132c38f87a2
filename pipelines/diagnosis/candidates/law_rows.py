"""Compute rows of the smooth laws and of the curves of time in the decision regression."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.candidates.quantisation import coarse_step, rounding
from pipelines.diagnosis.candidates.smooth_laws import (
    HUM,
    QUANTISATION,
    Curve,
    LawColumn,
    Spans,
    curves_of_time,
    smooth_laws,
)
from pipelines.diagnosis.evidence.decision_band import LENGTH_S
from pipelines.diagnosis.evidence.decision_regression import DecisionRegression
from pipelines.diagnosis.evidence.line_spectrum import Kind
from pipelines.diagnosis.evidence.prepared_runs import PreparedRuns
from pipelines.estimation.regression import away_from_reversals


def law_rows(
    prepared: PreparedRuns, regression: DecisionRegression
) -> tuple[list[LawColumn], NDArray]:
    """Return every smooth law and its rows, the baseline projected out.

    Parameters
    ----------
    prepared : PreparedRuns
    regression : DecisionRegression

    Returns
    -------
    list of LawColumn
        One for each column.
    (N, l) array
        Weighted rows; a coefficient is a share of the joint's rms torque.
    """
    joints = regression.joints
    spans = Spans.of(prepared.runs, prepared.torque[:joints])
    drives: list[NDArray] = []
    laws: Sequence[LawColumn] = ()
    for run, columns in zip(prepared.runs, prepared.columns, strict=True):
        laws, values = smooth_laws(run, spans, (columns @ prepared.values)[:, :joints])
        drives.append(values * spans.torque[:, np.newaxis])
    zero = [np.zeros_like(x) for x in drives]
    worn = [
        x * (run.motion.run == "with_human") for x, run in zip(drives, prepared.runs, strict=True)
    ]
    has_cuffs = bool(np.isfinite(prepared.noise.density[joints:]).any())
    kinds = {run.motion.run for run in prepared.runs}
    parts = [(list(laws), _both(drives, zero))]
    # One kind of run without cuffs cannot separate the wearer's share from the machine's.
    if "with_human" in kinds and (len(kinds) == 2 or has_cuffs):
        parts.append(([replace(law, wearer="human") for law in laws], _both(worn, worn)))
    if has_cuffs:
        # Laws of cuff forces, which may be wrong where the drives' torque is right.
        kinds_in_cuffs = "angle", "both_angles", "speed", "inertia_by_angle", "load", "other_load"
        chosen = [i for i, law in enumerate(laws) if law.kind in kinds_in_cuffs]
        own = [replace(laws[i], wearer="cuffs") for i in chosen]
        parts.append((own, [x[:, :, chosen] for x in _both(zero, worn)]))
    parts += [*_hums(prepared), *_coarse_steps(prepared)]
    rows = [regression.project(regression.rows(columns)) for _, columns in parts]
    return [law for some, _ in parts for law in some], np.hstack(rows)


def _hums(prepared: PreparedRuns) -> Iterator[tuple[list[LawColumn], list[NDArray]]]:
    """Yield the law and the columns of each joint's tones; every run has its own phases."""
    for j, lines in enumerate(prepared.lines):
        tones = np.array([line.cycles for line in lines.of_kind(Kind.TIME)])
        if not len(tones):
            continue
        width, count = 2 * len(tones), len(prepared.runs)
        columns = [np.zeros((*run.measured.shape, width * count)) for run in prepared.runs]
        for r, run in enumerate(prepared.runs):
            # At the full rate: a hum may turn several times within one block.
            phase = 2.0 * np.pi * np.outer(run.motion.time, tones)
            waves = run.average(np.hstack([np.sin(phase), np.cos(phase)]))
            columns[r][:, j, r * width : (r + 1) * width] = waves * prepared.torque[j]
        yield [LawColumn(HUM, j, "all", 1.0)] * (width * count), columns


def _coarse_steps(
    prepared: PreparedRuns,
) -> Iterator[tuple[list[LawColumn], list[NDArray]]]:
    """Yield the law and the column of each joint whose torque may have coarse steps."""
    runs = prepared.runs
    # A measured torque would be rounded already; the predicted one shows where steps fall.
    predicted = [run.slow(x) for run, x in zip(runs, prepared.predicted, strict=True)]
    residual = [
        run.slow(np.nan_to_num(run.motion.torque)) - x
        for run, x in zip(runs, predicted, strict=True)
    ]
    usable = [run.motion.valid[:, np.newaxis] & away_from_reversals(run.motion) for run in runs]
    for j, joint in enumerate(prepared.baseline.machine.joints):
        # Only a reading can be rounded.
        if not joint.has_sensor:
            continue
        rms = float(prepared.torque[j])
        torque, residuals = (
            [x[u[:, j], j] for x, u in zip(one, usable, strict=True)]
            for one in (predicted, residual)
        )
        step = coarse_step(torque, residuals, rms)
        if step is None:
            continue
        columns = [np.zeros((*run.measured.shape, 1)) for run in runs]
        for column, run, x in zip(columns, runs, predicted, strict=True):
            # Rounding has an rms of the step over the root of twelve. The column has the rms of the
            # joint's torque.
            column[:, j, 0] = run.average(rounding(x[:, j], step)) * np.sqrt(12.0) / step * rms
        yield [LawColumn(QUANTISATION, j, "all", 1.0)], columns


def _both(drives: Sequence[NDArray], cuffs: Sequence[NDArray]) -> list[NDArray]:
    """Stack columns of drives and of cuffs, (m, J, k) each, as outputs."""
    return [np.concatenate([d, c], axis=1) for d, c in zip(drives, cuffs, strict=True)]


def curve_rows(
    prepared: PreparedRuns, regression: DecisionRegression
) -> tuple[list[Curve], NDArray]:
    """Return every curve of time and its rows, the baseline projected out.

    Parameters
    ----------
    prepared : PreparedRuns
    regression : DecisionRegression

    Returns
    -------
    list of Curve
        One for each column.
    (N, t) array
        Weighted rows; a coefficient is a share of the joint's rms torque.
    """
    kept, rows = [], []
    for r, run in enumerate(prepared.runs):
        curves, variance = curves_of_time(run)
        # Noise adds twice its density over the duration to the square of a cosine's amplitude.
        duration = max(float(run.time[-1] - run.time[0]), LENGTH_S)
        # The constant counts as the slowest cosine, as pink noise has no finite density at 0.
        hz = np.maximum(np.arange(len(variance)), 1) / (2.0 * duration)
        noise = 2.0 * prepared.noise.excess(hz, LENGTH_S)[: regression.joints] / duration
        for j in run.motion.machine.measured_indices:
            parts = [np.zeros((*other.measured.shape, len(variance))) for other in prepared.runs]
            parts[r][:, j] = curves * prepared.torque[j]
            share = np.nan_to_num(noise[j] / prepared.torque[j] ** 2)
            kept += [Curve(j, r, float(v), float(s)) for v, s in zip(variance, share, strict=True)]
            rows.append(regression.project(regression.rows(parts)))
    return kept, np.hstack(rows)
