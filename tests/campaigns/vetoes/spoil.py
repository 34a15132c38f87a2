"""Faults of acquisition of graded size: each changes the columns of one run, and says its kinds.

Time, angles and torques are changed as a bad cable, clock, register or map does it. Set-points stay
as they are.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.random import Generator

from pipelines.contracts.fault_kind import FaultKind as Kind
from pipelines.contracts.joints import Joint

Spoil = Callable[[pd.DataFrame, tuple[Joint, ...], Generator], pd.DataFrame]


@dataclass(frozen=True)
class Spoiler:
    """A fault, the kinds by which it may be named, and whether all runs of a session have it."""

    spoil: Spoil
    kinds: tuple[Kind, ...]
    everywhere: bool = False
    joints: int = 1
    """Joints that a machine needs to have it."""

    @property
    def name(self) -> str:
        """What a table calls it."""
        return self.spoil.__name__.replace("_", " ")


def late_stamps(frame, joints, rng):
    """Stamps of a busy host: late by an exponential delay, below a sample."""
    period = float(np.median(np.diff(frame["time_s"])))
    late = np.minimum(rng.exponential(_between(rng, 0.02, 0.6), len(frame)), 0.9) * period
    return frame.assign(time_s=frame["time_s"] + late)


def wrong_rate(frame, joints, rng):
    """A clock that is 0.5 to 20 % fast or slow."""
    return frame.assign(
        time_s=frame["time_s"] * (1.0 + rng.choice([-1, 1]) * _between(rng, 5e-3, 0.2))
    )


def uneven_sampling(frame, joints, rng):
    """Samples taken at uneven instants under even stamps."""
    count = np.arange(len(frame))
    taken = np.sort(count + rng.normal(0.0, _between(rng, 0.05, 0.5), len(frame)))
    skipped = ("time_s", "sequence")
    new = {n: np.interp(taken, count, frame[n]) for n in frame.columns if n not in skipped}
    return frame.assign(**new)


def stuck_angle(frame, joints, rng):
    """An encoder that stops for 0.3 to 10 s."""
    return _constant(frame, _some(joints, rng).column("angle"), rng)


def stuck_torque(frame, joints, rng):
    """A torque that stops for 0.3 to 10 s."""
    return _constant(frame, _some(joints, rng).column("torque"), rng)


def saturated_torque(frame, joints, rng):
    """A current sensor that clips the largest 3 to 30 %."""
    name = _some(joints, rng).column("torque")
    limit = float(frame[name].abs().quantile(1.0 - _between(rng, 0.03, 0.3)))
    return frame.assign(**{name: frame[name].clip(-limit, limit)})


def stale_samples(frame, joints, rng):
    """A bus that repeats the last row in 3 to 30 % of the rows."""
    stale = rng.random(len(frame)) < _between(rng, 0.03, 0.3)
    names = [n for n in frame.columns if n not in ("time_s", "sequence")]
    new = frame[names].mask(np.broadcast_to(stale[:, None], (len(frame), len(names)))).ffill()
    return frame.assign(**new.bfill())


def degrees(frame, joints, rng):
    """One angle in degrees."""
    name = _some(joints, rng).column("angle")
    return frame.assign(**{name: np.degrees(frame[name])})


def another_unit(frame, joints, rng):
    """One torque in N·mm, N·cm, kgf·cm, lbf·in or kgf·m."""
    name = _some(joints, rng).column("torque")
    return frame.assign(**{name: frame[name] * rng.choice([1e3, 1e2, 10.197, 8.851, 1 / 9.80665])})


def reversed_torque(frame, joints, rng):
    """One torque that counts the other way."""
    name = _some(joints, rng).column("torque")
    return frame.assign(**{name: -frame[name]})


def reversed_angle(frame, joints, rng):
    """One angle that counts the other way."""
    name = _some(joints, rng).column("angle")
    return frame.assign(**{name: -frame[name]})


def exchanged_torques(frame, joints, rng):
    """The torques of two joints under each other's names."""
    return _exchanged(frame, [joint.column("torque") for joint in joints[:2]])


def exchanged_angles(frame, joints, rng):
    """The angles of two joints under each other's names."""
    return _exchanged(frame, [joint.column("angle") for joint in joints[:2]])


def sign_in_a_bit(frame, joints, rng):
    """A torque whose sign is a bit of its register, read as a plain number."""
    name = _some(joints, rng).column("torque")
    torque = frame[name].to_numpy()
    bit = np.abs(torque).max() * _between(rng, 1.05, 4.0)
    return frame.assign(**{name: np.where(torque < 0, bit - torque, torque)})


def one_drive_twice(frame, joints, rng):
    """One drive read for both joints."""
    one, other = rng.permutation([joint.column("torque") for joint in joints[:2]])
    return frame.assign(**{other: frame[one]})


def _some(joints: tuple[Joint, ...], rng: Generator) -> Joint:
    return joints[int(rng.integers(len(joints)))]


def _between(rng: Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _constant(frame: pd.DataFrame, name: str, rng: Generator) -> pd.DataFrame:
    seconds = min(_between(rng, 0.3, 10.0), 0.4 * float(np.ptp(frame["time_s"])))
    length = max(round(seconds / float(np.median(np.diff(frame["time_s"])))), 2)
    start = int(rng.integers(len(frame) // 10, max(len(frame) - length, len(frame) // 10 + 1)))
    values = frame[name].to_numpy().copy()
    values[start : start + length] = values[start]
    return frame.assign(**{name: values})


def _exchanged(frame: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    return frame.assign(**{a: frame[b] for a, b in zip(names, names[::-1], strict=True)})


SPOILERS = (
    Spoiler(late_stamps, (Kind.CLOCK,)),
    Spoiler(wrong_rate, (Kind.CLOCK,)),
    # The angle of one joint alone shows no difference between uneven instants and noise.
    Spoiler(uneven_sampling, (Kind.CLOCK,), joints=2),
    Spoiler(stuck_angle, (Kind.STUCK,)),
    Spoiler(stuck_torque, (Kind.STUCK, Kind.SATURATED)),
    Spoiler(saturated_torque, (Kind.SATURATED,)),
    Spoiler(stale_samples, (Kind.STALE,)),
    Spoiler(degrees, (Kind.UNIT,), everywhere=True),
    Spoiler(another_unit, (Kind.UNIT,), everywhere=True, joints=2),
    Spoiler(reversed_torque, (Kind.SIGN,), everywhere=True),
    Spoiler(reversed_angle, (Kind.SIGN,), everywhere=True),
    Spoiler(exchanged_torques, (Kind.SWAP,), everywhere=True, joints=2),
    Spoiler(exchanged_angles, (Kind.SWAP,), everywhere=True, joints=2),
    Spoiler(sign_in_a_bit, (Kind.SIGN_BIT,), everywhere=True),
    Spoiler(one_drive_twice, (Kind.COPY,), everywhere=True, joints=2),
)
