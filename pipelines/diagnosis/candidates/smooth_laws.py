"""Define smooth laws outside the catalogue: torque as a free function of angle, speed, load ...

They compete with the catalogue's causes, describe how the true form of a cause may differ from the
listed one, and at a small size are the background of a good rig. Every column is dimensionless and
of order one, so that its coefficient is a share of the joint's rms torque.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legder, legval, legvander
from numpy.typing import NDArray

from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.wording.law import law_label

TIME = "time"
"""The law whose columns are each run's own curves of time."""
HUM = "hum"
"""The law whose columns are tones with a phase in each run."""
BURSTS = "bursts"
"""The law of knocks at random times. It has no columns: its evidence is in the scatter."""
QUANTISATION = "quantisation"
"""The law of a torque that is reported in coarse steps: its column is the rounding error."""


@dataclass(frozen=True)
class LawColumn:
    """One column of a smooth law."""

    kind: str
    joint: int | None
    """None where it acts at both joints at once."""
    wearer: str
    """``all`` runs' drives; the ``human``'s share, in drives and cuffs; the ``cuffs`` alone."""
    variance: float
    """Prior variance of the coefficient relative to the law's other columns."""

    def variant(self, joints: Sequence[str]) -> str:
        """Return the law's label with the wearer's share that it acts on."""
        return law_label(self.kind, None if self.joint is None else joints[self.joint], self.wearer)


class Curve(NamedTuple):
    """A cosine over one run, by which a joint's torque may wander."""

    joint: int
    run: int
    variance: float
    """Prior variance of its coefficient relative to the others'."""
    noise: float
    """Variance of its coefficient in slow noise, in squared shares of the joint's rms torque."""


@dataclass(frozen=True)
class Spans:
    """Scales that make a session's motion dimensionless, (J,) each."""

    middle: NDArray
    half_range: NDArray
    sum_middle: float
    """Of the sum of all angles."""
    sum_half_range: float
    speed: NDArray
    acceleration: NDArray
    torque: NDArray
    duration_s: float

    @classmethod
    def of(cls, runs: Sequence[Run], torque: NDArray) -> "Spans":
        """Compute the scales of the searched runs.

        Parameters
        ----------
        runs : sequence of Run
            The searched runs of J joints.
        torque : (J,) array
            rms torque of each joint, N·m.
        """
        low = np.min([run.state[0].min(axis=0) for run in runs], axis=0)
        high = np.max([run.state[0].max(axis=0) for run in runs], axis=0)
        speed, acceleration = (
            np.sqrt(np.mean(np.concatenate([run.state[k] for run in runs]) ** 2, axis=0))
            for k in (1, 2)
        )
        sums = np.concatenate([run.state[0].sum(axis=1) for run in runs])
        tiny = np.finfo(float).tiny
        return cls(
            0.5 * (low + high),
            np.maximum(0.5 * (high - low), tiny),
            0.5 * float(sums.min() + sums.max()),
            max(0.5 * float(np.ptp(sums)), tiny),
            np.maximum(speed, tiny),
            np.maximum(acceleration, tiny),
            np.maximum(torque, tiny),
            max(float(run.time[-1] - run.time[0]) for run in runs),
        )


def smooth_laws(run: Run, spans: Spans, load: NDArray) -> tuple[list[LawColumn], NDArray]:
    """Return the laws of a run's drives and their columns, (m, J, k).

    Parameters
    ----------
    run : Run
    spans : Spans
        Scales of the session's motion.
    load : (m, J) array
        The torque that the baseline predicts, N·m.
    """
    joints = run.state[0].shape[1]
    laws: list[LawColumn] = []
    parts: list[tuple[int | slice, NDArray]] = []
    # The torque at a joint where it was not measured shows nothing.
    for j in run.motion.machine.measured_indices:
        for kind, degree, column in _laws_of(run, spans, load, j):
            # Real laws are smooth: the prior variance falls with the degree.
            laws.append(LawColumn(kind, j, "all", 1.0 / (1.0 + degree)))
            parts.append((j, column))
    # An elastic energy of both angles, as of a muscle or a band over two joints. It is a polynomial
    # in two angles, so other machines have no such law.
    if joints == 2 and not any(joint.turns for joint in run.motion.machine.joints):
        for degree, pulls in _across_joints(_scaled_angle(run, spans), spans):
            laws.append(LawColumn("across_joints", None, "all", 1.0 / (1.0 + degree)))
            parts.append((slice(None), pulls))
    columns = np.zeros((len(run.time), joints, len(parts)))
    for k, (at, column) in enumerate(parts):
        columns[:, at, k] = column
    return laws, columns


def _scaled_angle(run: Run, spans: Spans) -> NDArray:
    """Return the angles (m, J), scaled to lie between -1 and 1 on the searched runs."""
    return np.clip((run.state[0] - spans.middle) / spans.half_range, -1.5, 1.5)


def _of_angle(run: Run, spans: Spans) -> list[NDArray]:
    """Return functions of each joint's angle, (m, degrees)."""
    scaled, joints = _scaled_angle(run, spans), run.motion.machine.joints
    return [
        _waves(run.state[0][:, j]) if joint.turns else _polynomials(scaled[:, j])
        for j, joint in enumerate(joints)
    ]


def _of_sum(run: Run, spans: Spans) -> NDArray:
    """Return such functions of the sum of all angles."""
    sums = run.state[0].sum(axis=1)
    if any(joint.turns for joint in run.motion.machine.joints):
        return _waves(sums)
    return _polynomials(np.clip((sums - spans.sum_middle) / spans.sum_half_range, -1.5, 1.5))


def _polynomials(x: NDArray, count: int = 10) -> NDArray:
    """Return Legendre polynomials of a scaled angle, (m, count), by degree."""
    return legvander(x, count - 1)


def _waves(angle: NDArray, count: int = 10) -> NDArray:
    """Return 1, sin q, cos q, sin 2q, cos 2q ... of an angle that repeats, (m, count)."""
    phase = np.outer(angle, np.arange(1, count // 2 + 1))
    waves = np.stack([np.sin(phase), np.cos(phase)], axis=2).reshape(len(angle), -1)
    return np.column_stack([np.ones(len(angle)), waves])[:, :count]


def _across_joints(x: NDArray, spans: Spans) -> Iterator[tuple[int, NDArray]]:
    """Yield degree and torque (m, 2) of each part of an elastic energy of both angles.

    The torques at both joints are the slopes of one energy. Its parts are products of Legendre
    polynomials of the scaled angles ``x`` (m, 2), those of one angle alone among them; the larger
    torque of each is of order one.
    """
    # Highest degree of the elastic energy.
    highest_degree = 4
    every = np.eye(highest_degree + 1)
    value, slope = legval(x, every), legval(x, legder(every))
    degree = np.arange(highest_degree + 1)
    # Rms of each polynomial and of its slope over the whole range.
    rms, steep = 1.0 / np.sqrt(2.0 * degree + 1.0), np.sqrt(0.5 * degree * (degree + 1.0))
    # Dividing by half the range makes the slope one by the angle itself, by the torque a share.
    units = spans.half_range * spans.torque
    for a, b in product(degree, degree):
        # Degree 0 has no torque. Degree 1 has a constant one, as the law of a joint's angle has.
        if 2 <= a + b <= highest_degree:
            pulls = (
                np.column_stack([slope[a, :, 0] * value[b, :, 1], value[a, :, 0] * slope[b, :, 1]])
                / units
            )
            largest = max(steep[a] * rms[b] / units[0], rms[a] * steep[b] / units[1])
            # The torque's degree is one less than the energy's.
            yield int(a + b - 1), pulls / largest


LawTerm = tuple[str, int, NDArray]
"""Kind, degree and column (m,) of a smooth law."""


def _laws_of(run: Run, spans: Spans, load: NDArray, j: int) -> Iterator[LawTerm]:
    """Yield the laws at one joint."""
    q = _of_angle(run, spans)
    scaled = _ScaledMotion(
        q, run.state[1] / spans.speed, run.state[2] / spans.acceleration, load / spans.torque
    )
    joints = run.motion.machine.joints
    # Half waves over the longest run: the slowest change is a single rise or fall.
    phase = np.pi * (run.time - run.time[0]) / spans.duration_s
    yield from scaled.laws_of_itself(j)
    # A passive joint carries no load: what is predicted there is the residual itself, and a gain on
    # it would explain all of that.
    if joints[j].has_sensor:
        yield from scaled.laws_of_load(j)
        # A constant gain of the drives would let bodies without inertia explain that a passive
        # joint has no torque.
        lowest = 1 if any(joint.is_passive for joint in joints) else 0
        for k in range(lowest, 4):
            yield "gain_over_time", k, scaled.tau[:, j] * np.cos(k * phase)
    for k in range(1, 4):
        yield "friction_over_time", k, scaled.way[:, j] * np.cos(k * phase)
        yield "friction_over_time", k, scaled.v[:, j] * np.cos(k * phase)
    if len(q) > 1:
        yield from _scaled("both_angles", _of_sum(run, spans), range(1, 6))
    for o in range(len(q)):
        if o != j:
            yield from scaled.laws_of_another(j, o, carries_load=joints[o].has_sensor)


@dataclass(frozen=True)
class _ScaledMotion:
    """The motion of J joints as shares of its spans, m samples."""

    q: Sequence[NDArray]
    """Functions (m, k) of each joint's angle."""
    v: NDArray
    a: NDArray
    tau: NDArray
    """(m, J) each."""

    @property
    def way(self) -> NDArray:
        """Direction of each joint, (m, J)."""
        return np.sign(self.v)

    def laws_of_itself(self, j: int) -> Iterator[LawTerm]:
        """Yield laws of a joint's own angle, speed and acceleration."""
        here, way = self.v[:, j], self.way[:, j]
        yield from _scaled("angle", self.q[j], range(self.q[j].shape[1]))
        yield from _speed_laws(here, way)
        # Coulomb friction first, then viscous. Degree 0 of both is in the baseline.
        yield from _scaled("friction_by_angle", self.q[j], range(1, 5), way)
        yield from _scaled("friction_by_angle", self.q[j], range(1, 4), here)
        yield from _scaled("inertia_by_angle", self.q[j], range(3), self.a[:, j])

    def laws_of_load(self, j: int) -> Iterator[LawTerm]:
        """Yield laws of a joint's own load."""
        force, way = self.tau[:, j], self.way[:, j]
        size = np.abs(force)
        # The first two are friction that grows with the load. The others are a gain that depends on
        # the load's sign or size.
        for column in (size * way, np.sqrt(size) * way, size, force * size):
            yield "load", 1, column

    def laws_of_another(self, j: int, o: int, *, carries_load: bool) -> Iterator[LawTerm]:
        """Yield laws at joint ``j`` of joint ``o``'s motion, and of its load if it carries one."""
        here, way = self.v[:, j], self.way[:, j]
        yield from _scaled("other_angle", self.q[o], range(1, 6))
        # The first function of an angle is the scaled angle itself, or its sine.
        one, two = self.q[j][:, 1], self.q[o][:, 1]
        yield "both_angles", 2, one * two
        yield "both_angles", 3, one**2 * two
        yield "both_angles", 3, one * two**2
        other = self.v[:, o]
        for column in (self.way[:, o], other, np.abs(other), other * np.abs(other), here * other):
            yield "other_speed", 1, column
        if carries_load:
            yield "other_load", 1, self.tau[:, o]
            yield "other_load", 1, np.abs(self.tau[:, o]) * way
        yield from _scaled("friction_by_other_angle", self.q[o], range(1, 4), way)
        yield from _scaled("friction_by_other_angle", self.q[o], range(1, 3), here)
        yield "inertia_by_angle", 2, self.a[:, o]


def _scaled(
    kind: str, functions: NDArray, degrees: range, factor: NDArray | float = 1.0
) -> Iterator[tuple[str, int, NDArray]]:
    """Yield functions of an angle times a factor, one for each degree."""
    for degree in degrees:
        yield kind, degree, functions[:, degree] * factor


def _speed_laws(v: NDArray, way: NDArray) -> Iterator[tuple[str, int, NDArray]]:
    """Yield laws of a speed (m,) in units of its rms, even and odd, smooth and peaked at zero."""
    size = np.abs(v)
    # Even parts are friction that differs with direction, odd ones a friction curve that bends. The
    # peaks are Stribeck's, with exponents 1 and 2.
    even = (size, v**2, size**3)
    odd = (way * v**2, v**3, way * np.sqrt(size))
    peaks = (way * np.exp(-size / 0.2), way * np.exp(-((size / 0.6) ** 2)))
    for column in (*even, *odd, *peaks):
        yield "speed", 1, column


def curves_of_time(run: Run) -> tuple[NDArray, NDArray]:
    """Return cosines over a run, and the relative prior variance of their coefficients.

    Parameters
    ----------
    run : Run

    Returns
    -------
    (m, k) array
        Cosines.
    (k,) array
        Variances.
    """
    elapsed = run.time - run.time[0]
    duration = float(elapsed[-1]) + 1e-6
    # Highest frequency of each run's own curves of time, Hz.
    highest_hz = 0.5
    # Largest number of curves of time in one run.
    most_curves = 80
    # Curve k has k half waves, and so the frequency k / (2 duration).
    k = np.arange(min(most_curves, int(2.0 * highest_hz * duration)) + 1)
    curves = np.cos(np.pi * np.outer(elapsed / duration, k))
    # Corner above which the power of a wandering torque falls, as of a random walk, Hz.
    corner_hz = 0.1
    # A random walk's power falls with the square of the frequency above the corner.
    variance = 1.0 / (1.0 + (k / (2.0 * duration * corner_hz)) ** 2)
    return curves, variance / variance.sum()
