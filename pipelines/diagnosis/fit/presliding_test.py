"""Test whether a joint's friction reverses at once, or builds up over a travel.

No fit uses these samples. A faultless joint with dry friction may stand at a reversal while the
torque changes; one whose friction is elastic yields all along. Their torques are alike, their
angles are not: the first does not move while friction changes sides, and the encoder shows the
travel of the second. So the model's own Coulomb friction is reversed at once, late, over a range of
speeds and over a travel, and each is compared with the torque there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.baseline import Baseline
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.diagnosis.fit.fitted_model import model_of_run
from pipelines.diagnosis.fit.joint_fit import Fit
from pipelines.effects.baseline import Friction
from pipelines.estimation.angle_noise import CUTOFF_HZ
from pipelines.estimation.regression import turns
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.slow_motion import filtered, unsure
from pipelines.model import Model
from pipelines.signals.blocks import dilate

NEAR_S = 0.12
"""Half width of a reversal's neighbourhood, s: the memory of a low-pass of ``CUTOFF_HZ``."""


@dataclass(frozen=True)
class BuildUp:
    """Friction of a joint that builds up over a travel after each reversal."""

    joint: str
    travel: float
    """rad, m at a prismatic joint: the travel over which 63 % of it changes sides."""
    at_once: float
    otherwise: float
    over_travel: float
    """N·m rms near reversals of the validation runs, below ``CUTOFF_HZ``: the residual of friction
    that changes sides at once, in the best way without a travel, and over it."""


@dataclass(frozen=True)
class _About:
    """A run near the reversals of a joint."""

    motion: Motion
    model: Model
    j: int
    read: NDArray
    """(n,) the joint's angle as measured by its encoder."""
    speed: NDArray
    """(n,)."""
    rest: NDArray
    """(n,) N·m measured less the model's torque without Coulomb friction, below the cut-off."""
    level: float
    """N·m of Coulomb friction."""
    near: NDArray
    """(n,) bool."""

    @property
    def seconds(self) -> float:
        return float(self.near.sum() / self.motion.sample_rate_hz)

    @classmethod
    def of(cls, motion: Motion, model: Model, baseline: Baseline, j: int) -> "_About | None":
        """Prepare a run; return None if its reversals show nothing.

        They show nothing without measured angles or Coulomb friction, or without motion above the
        cut-off.
        """
        label = Friction(baseline.joints[j], on=baseline.machine).label
        coulomb = [
            (effect.label, p.name) == (label, "coulomb") for effect, p in model.linear_parameters
        ]
        level, near = float(model.linear_values[coulomb].sum()), _near(motion, j)
        # A motion that is filtered as low as the torque here lacks a part that its torque has.
        if (
            motion.measured_angle is None
            or motion.cutoff_hz <= CUTOFF_HZ
            or level <= 0.0
            or not near.any()
        ):
            return None
        read, speed = np.ascontiguousarray(motion.measured_angle[:, j]), motion.dq[:, j]
        without_coulomb = model.with_linear(np.where(coulomb, 0.0, model.linear_values))
        # Coulomb friction is left out of the model here, and added again in each way of reversing.
        other_torque = without_coulomb.torque(motion)[:, j]
        rest = filtered(motion, motion.torque[:, j] - other_torque, CUTOFF_HZ)
        return cls(motion, model, j, read, speed, rest, level, near)

    def remainder(self, side: "Side") -> NDArray:
        """Return the residual near reversals, (near,) N·m, with friction on the given side."""
        column = np.zeros((*self.motion.q.shape, 1))
        column[:, self.j, 0] = self.level * side(self)
        # A gain or a delay of the torque sensor acts on friction too.
        seen = self.model.observed(column, self.motion)[:, self.j, 0]
        return (self.rest - filtered(self.motion, seen, CUTOFF_HZ))[self.near]


def _near(motion: Motion, j: int) -> NDArray:
    """Return the valid samples near a joint's reversals, (n,) bool."""
    about = dilate(turns(motion)[:, j], round(NEAR_S * motion.sample_rate_hz))
    return np.asarray(about & motion.valid & ~unsure(motion, CUTOFF_HZ))


Side = Callable[[_About], NDArray]
"""The side on which friction is along a run, (n,) from -1 to 1."""


def built_up(
    fit: Fit, baseline: Baseline, train: Sequence[Run], validate: Sequence[Run]
) -> list[BuildUp]:
    """Return the joints whose friction builds up over a travel that no named cause explains.

    The training runs determine the travel, and the validation runs confirm it.

    Parameters
    ----------
    fit : Fit
    baseline : Baseline
    train, validate : sequences of Run
    """
    # Their friction changes sides over a travel anyway.
    known = {cause.effect.joint for cause in fit.causes if cause.effect.reversal_travel}
    # Once for all joints: per-run values are fitted for each model.
    runs = [
        [(run.motion, model_of_run(fit, baseline, run)) for run in some]
        for some in (train, validate)
    ]
    rows = []
    for j, joint in enumerate(baseline.joints):
        if joint in known:
            continue
        seen = [[_About.of(*run, baseline, j) for run in some] for some in runs]
        about = [[one for one in some if one is not None] for some in seen]
        if not all(about):
            continue
        one = _of_joint(about[0], about[1], baseline, j)
        if one is not None:
            rows.append(one)
    return rows


def _of_joint(
    train: Sequence[_About], validate: Sequence[_About], baseline: Baseline, j: int
) -> BuildUp | None:
    joint = baseline.joints[j]
    scale = baseline.machine.scale(joint)
    count = max(_count(about.read) for about in (*train, *validate))
    # Over a shorter travel than two counts, friction changes sides between two readings.
    at_once = 2e-5 * scale.travel
    shortest = max(at_once, 2 * count)
    # A longer travel shows away from reversals too.
    longest = 0.01 * scale.travel
    # A coarse encoder does not show travels as short as presliding.
    if 2.0 * shortest > longest:
        return None
    travels = np.geomspace(shortest, longest, 16)
    over = [_side_over(0.5 * count, travel) for travel in travels]
    best, trained = _best(train, over)
    if best in (0, len(travels) - 1):
        # At once, within the encoder's resolution, or over more than a reversal's neighbourhood.
        return None
    # At once by the measured angle is a rival too: its gain is not the travel's.
    rivals = [_side_over(0.5 * count, at_once), *_sides_without_travel(scale.speed)]
    beaten, otherwise = (_best(some, rivals)[1] for some in (train, validate))
    remaining = _power(validate, over[best])
    # Share of the error's power near reversals that a travel must explain in addition to a rival.
    taken = 0.2
    # Log likelihood that a travel must gain over the best rival.
    needed = 6.0
    independent = CUTOFF_HZ * sum(about.seconds for about in train)
    # The travel was chosen on the training runs, so the validation runs must gain as well.
    ratios = trained / beaten, remaining / otherwise
    if max(ratios) > 1.0 - taken or -0.5 * independent * np.log(ratios[0]) < needed:
        return None
    return BuildUp(
        joint,
        float(travels[best]),
        *np.sqrt([_power(validate, _side_at_once), otherwise, remaining]).tolist(),
    )


def _sides_without_travel(scale: float) -> list[Side]:
    """Return the ways in which friction changes sides at once, by speed or late.

    ``scale`` is the joint's speed over an exoskeleton's.
    """
    # Speeds, rad/s, on an exoskeleton's scale, within which friction that depends on speed
    # reverses.
    speeds = (0.02, 0.04, 0.08, 0.16, 0.32)
    # Delays after the reversal, as far as `time_delay` goes, s. Friction is late where the torque
    # is read late.
    late_s = (0.02, 0.04, 0.06)
    by_speed = [_side_by_speed(speed * scale) for speed in speeds]
    return [_side_at_once, *by_speed, *map(_side_late, late_s)]


def _best(some: Sequence[_About], sides: Sequence[Side]) -> tuple[int, float]:
    """Return the side with the least remaining power, and that power."""
    powers = [_power(some, side) for side in sides]
    return int(np.argmin(powers)), min(powers)


def _power(some: Sequence[_About], side: Side) -> float:
    return float(np.mean(np.concatenate([about.remainder(side) for about in some]) ** 2))


def _side_at_once(about: _About) -> NDArray:
    return np.sign(about.speed)


def _side_by_speed(speed: float) -> Side:
    return lambda about: np.tanh(about.speed / speed)


def _side_late(delay: float) -> Side:
    return lambda about: np.interp(
        about.motion.time - delay, about.motion.time, np.sign(about.speed)
    )


def _side_over(grain: float, travel: float) -> Side:
    return lambda about: np.asarray(dahl(about.read, grain, travel))


def _count(angle: NDArray) -> float:
    """Return the smallest step of a measured angle above rounding."""
    read = angle[np.isfinite(angle)]
    steps = np.abs(np.diff(read))
    # Share of the largest angle below which a step between two readings is rounding.
    rounding = 1e-9
    return float(np.min(steps[steps > rounding * np.abs(read).max(initial=0.0)], initial=np.inf))


@njit(cache=True)
def dahl(angle: NDArray, grain: float, travel: float) -> NDArray:
    """Return Dahl's friction along an angle, from -1 to 1, (n,).

    It depends on the travel, not on time. Dahl (1976), AIAA Journal 14(12), eq. 4, exponent 1.

    Parameters
    ----------
    angle : (n,) array
        rad or m.
    grain : float
        An encoder that flickers by less has not moved.
    travel : float
        Over which 63 % of the friction changes sides.
    """
    out = np.zeros(len(angle))
    at, z = angle[0], 0.0
    for i in range(1, len(angle)):
        away = angle[i] - at
        if abs(away) > grain:
            way = 1.0 if away > 0.0 else -1.0
            z = way + (z - way) * np.exp(-(abs(away) - grain) / travel)
            # The dead band follows the angle, as play does.
            at = angle[i] - way * grain
        out[i] = z
    return out
