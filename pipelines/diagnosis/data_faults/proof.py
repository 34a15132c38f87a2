"""What mending a channel would change: the proof of a fault, and the ruling on it.

A fault may stop the diagnosis only if mending it would change the answer. So the torque that a
rigid body with friction predicts on data it was not fitted to is compared with the torque as
recorded, and with the mended one.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.data_faults.rigid_fit import (
    LEAST_BLOCKS,
    Averages,
    averages,
    fit,
    joined,
    predicted,
)
from pipelines.mechanics.motion import Motion

MOST = 0.5
"""Share of the error that may remain where mending removes most of it, for each channel that would
be wrong: more wrong channels are less likely. A missing effect of a quarter of the torque changes
the error by a few tenths."""
AGREES = 0.9
"""Correlation of the mended torque with its prediction from which they agree. A missing effect of
40 % of the torque leaves 0.92."""


class Ruling(Enum):
    """What a fault may do to the diagnosis."""

    VETO = auto()
    """Mending removes most of the error, and the mended channel agrees with the prediction."""
    CAVEAT = auto()
    """Mending would change too little to stop at, or shows too little."""
    REFUTED = auto()
    """Mending would make most of the error."""


@dataclass(frozen=True)
class Proof:
    """Errors as recorded and mended."""

    recorded: float
    """Share of the torque's variance that is not predicted, as recorded."""
    mended: float
    """The same once mended."""
    agreement: float
    """Correlation of the mended torque with its prediction, of the joint where it is least."""
    channels: int = 1
    """Channels that would be wrong."""

    @property
    def removes_most(self) -> bool:
        """Whether mending removes most of the error."""
        return self.mended < MOST**self.channels * self.recorded

    @property
    def ruling(self) -> Ruling:
        """The ruling that these numbers allow."""
        if self.removes_most:
            return Ruling.VETO if self.agreement > AGREES else Ruling.CAVEAT
        opposite = self.recorded < MOST**self.channels * self.mended
        return Ruling.REFUTED if opposite else Ruling.CAVEAT

    @property
    def in_words(self) -> str:
        """The change of the error by the mend."""
        return (
            f"Mended, rigid body and friction leave {_percent(self.mended)} of the variance"
            f" unexplained, {_percent(self.recorded)} as recorded (correlation"
            f" {self.agreement:.2f})"
        )


@dataclass(frozen=True)
class Prediction:
    """A measured torque and its prediction, (m,) N·m each."""

    measured: NDArray
    predicted: NDArray

    @property
    def unexplained(self) -> float:
        """Share of the measured variance that is not predicted; 1 where nothing changes."""
        error = self.measured - self.predicted
        variance = float(np.var(self.measured))
        return float(np.mean(error**2)) / variance if variance > 0.0 else 1.0

    @property
    def agreement(self) -> float:
        """Correlation of both; 0 where one does not change."""
        if min(np.ptp(self.measured), np.ptp(self.predicted)) == 0.0:
            return 0.0
        return float(np.corrcoef(self.measured, self.predicted)[0, 1])


def predictions(run: Averages) -> list[Prediction]:
    """Return the prediction of each joint's torque on the part of the run it was not fitted to."""
    return [
        Prediction(run.torque[:, j], predicted(run.columns(j), run.torque[:, j]))
        for j in run.joints
    ]


def compared(
    recorded: Iterable[Prediction], mended: Sequence[Prediction], channels: int = 1
) -> Proof:
    """Return the proof of a fault from the predictions at the joints that it changes."""
    return Proof(
        float(np.mean([one.unexplained for one in recorded])),
        float(np.mean([one.unexplained for one in mended])),
        min(one.agreement for one in mended),
        channels,
    )


def by_motion(recorded: Motion, mended: Motion | None, channels: int = 1) -> Proof | None:
    """Return the proof of a fault whose mend changes the motion.

    Parameters
    ----------
    recorded : Motion
        The run as it is.
    mended : Motion or None
        The same run without the fault; None where it cannot be mended.
    channels : int
        Channels that would be wrong.

    Returns
    -------
    Proof or None
        None where a run has too few blocks to fit a body.
    """
    return next(iter(by_motions(recorded, [mended], channels)), None)


def by_motions(recorded: Motion, mended: Iterable[Motion | None], channels: int = 1) -> list[Proof]:
    """Return the proofs of several mends of one run, without those that have none."""
    run = averages(recorded)
    if run is None:
        return []
    before = predictions(run)
    others = [averages(motion) for motion in mended if motion is not None]
    return [compared(before, predictions(one), channels) for one in others if one is not None]


def by_good_samples(recorded: Motion, session: Sequence[Motion]) -> Proof | None:
    """Return the proof that samples of a run are wrong, of which too few remain to fit a body.

    A body fitted to the good samples of all runs of its kind predicts these, and the whole run.

    Parameters
    ----------
    recorded : Motion
        The run as it is.
    session : sequence of Motion
        All runs of the session, without wrong samples.

    Returns
    -------
    Proof or None
        None where too few good samples are in the session.
    """
    whole = averages(recorded)
    alike = [averages(motion, least=1) for motion in session if motion.run == recorded.run]
    good = [run for run in alike if run is not None]
    if whole is None or sum(len(run.q) for run in good) < LEAST_BLOCKS:
        return None
    as_recorded, mended = [], []
    for j in whole.joints:
        columns = joined([run.columns(j) for run in good])
        torque = np.concatenate([run.torque[:, j] for run in good])
        by_them = whole.columns(j).torque(fit(columns, torque))
        as_recorded.append(Prediction(whole.torque[:, j], by_them))
        mended.append(Prediction(torque, predicted(columns, torque)))
    return compared(as_recorded, mended)


def _percent(share: float) -> str:
    percent = 100 * share
    return f"{percent:.2g} %" if percent < 100 else f"{percent:.0f} %"
