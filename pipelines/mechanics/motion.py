"""A measured motion, from which regressions, diagnoses and replays are computed."""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joint_units import Scale
from pipelines.contracts.joints import joints_of
from pipelines.contracts.table import Table
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.load import LoadColumns
from pipelines.mechanics.machine import Machine, machine_of
from pipelines.mechanics.mechanisms.leg import LEG, cuff_torque
from pipelines.signals.interpolation import between_readings
from pipelines.signals.low_pass import derivative, low_pass, shortest

CUFFS = tuple(f"{segment}_{side}" for segment in ("thigh", "shank") for side in ("front", "back"))


@dataclass(frozen=True)
class Motion:
    """One run with every sample; n samples, J joints, SI units.

    ``torque`` is measured; ``q``, ``dq`` and ``ddq`` come from the zero-phase filter.
    """

    time: NDArray
    """(n,) s."""
    q: NDArray
    """(n, J) rad."""
    dq: NDArray
    """(n, J) rad/s."""
    ddq: NDArray
    """(n, J) rad/s²."""
    torque: NDArray
    """(n, J) N·m."""
    segment: NDArray
    """(n,) number of the stretch without a gap."""
    valid: NDArray
    """(n,) whether all channels of a sample are usable."""
    run: str = "exo_alone"
    purpose: str = "train"
    sample_rate_hz: float = 200.0
    period_s: float | None = None
    joints: tuple[str, ...] = ("hip", "knee")
    geometry: Geometry = field(default_factory=Geometry)
    forces: NDArray | None = None
    """(n, 4, 3) N as measured, cuffs in the order of ``CUFFS``; None if they were not measured."""
    reference: NDArray | None = None
    """(n, J) commanded angle."""
    measured_angle: NDArray | None = None
    """(n, J) angle of the encoders, before any filter."""
    sequence: NDArray | None = None
    """(n,) sample counter of the device."""
    temperature: NDArray | None = None
    """(n, J) °C."""
    cutoff_hz: float = 12.0
    """Cut-off of the zero-phase filter."""
    load: NDArray | None = None
    """(n, J) N·m that the drive trains transmit to the links, if a fit has estimated it."""
    limb_load: NDArray | None = None
    """(n, J) N·m of the machine on the wearer's limb, if a fit has estimated it."""
    body: NDArray | None = None
    """(p,) inertial parameters of everything behind the drive trains, if a fit has estimated
    them."""
    limb_body: NDArray | None = None
    """(p,) the same for the wearer's limb alone."""
    scales: tuple[Scale, ...] = ()
    """Scale of each joint relative to an exoskeleton's; empty for an exoskeleton."""
    file: str = ""
    metadata: dict[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time)

    @cached_property
    def machine(self) -> Machine:
        """The machine that moved, by its joints."""
        return machine_of(joints_of(self.metadata), self.geometry, self.file, self.scales)

    def pieces(self, margin: int) -> Iterator["Piece"]:
        """Yield the run as a single piece, because all of it is in memory.

        Parameters
        ----------
        margin : int
            Ignored: a whole run has no neighbours.

        Yields
        ------
        Piece
            With all n samples.
        """
        yield Piece(self, slice(0, len(self)), 0)

    def whole(self) -> "Motion":
        """Return the motion itself, which is in memory."""
        return self

    def joint_index(self, joint: str) -> int:
        """Return the column of a joint in q, dq, ddq and torque."""
        return self.joints.index(joint)

    def segments(self) -> Iterator[slice]:
        """Yield each stretch of samples without a gap.

        Yields
        ------
        slice
            Into the n samples.
        """
        # The prepended number differs from the first one, so that row 0 begins a stretch.
        starts = np.flatnonzero(np.diff(self.segment, prepend=self.segment[0] - 1))
        for start, stop in zip(starts, [*starts[1:], len(self)], strict=True):
            yield slice(int(start), int(stop))

    @cached_property
    def held_forces(self) -> NDArray | None:
        """Cuff forces at every sample, (n, 4, 3) N, interpolated if they were read less often.

        NaN where readings are too far apart; None without readings.
        """
        # Longest interval between two force readings that is interpolated, s. A leg that moves at 1
        # Hz covers a tenth of its range in it.
        most_unread_s = 0.1
        if self.forces is None or np.isfinite(self.forces).all():
            return self.forces
        forces, longest = self.forces.copy(), max(round(most_unread_s * self.sample_rate_hz), 1)
        for stretch in self.segments():
            for cuff in range(len(CUFFS)):
                forces[stretch, cuff] = between_readings(self.forces[stretch, cuff], longest)
        return forces

    @cached_property
    def interpolated_temperature(self) -> NDArray:
        """Temperature of each joint's drive or motor at every sample, (n, J) °C.

        Linear between readings; NaN at a joint without any.
        """
        measured = self.temperature
        read = np.full(self.q.shape, np.nan) if measured is None else measured.copy()
        for column in read.T:
            known = np.isfinite(column)
            if known.any() and not known.all():
                # Before the first reading and after the last one, the nearest one holds.
                column[:] = np.interp(self.time, self.time[known], column[known])
        return read

    @property
    def on_segments(self) -> NDArray | None:
        """Cuff forces on thigh and shank, front and back together, (n, 2, 3) N, or None."""
        forces = self.held_forces
        # The order of CUFFS is segment, then side; the sum is over front and back.
        return None if forces is None else forces.reshape(-1, 2, 2, 3).sum(axis=2)

    def cuff_torque(self, q: NDArray) -> NDArray | None:
        """Return the torque of the cuffs on a limb.

        Parameters
        ----------
        q : (n, 2) array
            Angles of the limb's hip and knee, rad.

        Returns
        -------
        (n, 2) array or None
            N·m, NaN where it is unknown; None if it was not measured.
        """
        forces = self.on_segments
        if forces is None or self.machine.mechanism is not LEG or not self.geometry.has_cuffs:
            return None
        return cuff_torque(forces[:, 0], forces[:, 1], q, self.geometry)

    @cached_property
    def transmitted(self) -> tuple[NDArray, NDArray, NDArray]:
        """Torque transmitted to the links, with its first and second derivative, (n, J) each.

        The estimate of a fit if there is one; otherwise the measured torque, which contains the
        drive's own friction.
        """
        return self._smoothed(self.torque if self.load is None else self.load)

    @cached_property
    def on_limb(self) -> tuple[NDArray, NDArray, NDArray]:
        """Torque of the machine on the wearer's limb, with two derivatives, (n, J) each.

        The estimate of a fit if there is one; otherwise from the cuff forces, or the torque
        transmitted to the links.
        """
        if self.limb_load is not None:
            return self._smoothed(self.limb_load)
        torque = self.cuff_torque(self.q)
        # Without cuff forces, the machine's links are the best estimate of the wearer's limb.
        if torque is None:
            return self.transmitted
        # Samples without forces take the links' torque, or the filter would spread their NaN.
        return self._smoothed(np.where(np.isfinite(torque), torque, self.transmitted[0]))

    @cached_property
    def columns_known(self) -> dict[Hashable, tuple[tuple[float, ...], NDArray]]:
        """The last shape, and its columns (n, J, k) along this motion, by effect.

        None depends on the loads.
        """
        return {}

    @cached_property
    def load_columns(self) -> LoadColumns:
        """Load of a body along this motion, per unit of each inertial parameter."""
        return LoadColumns(self.machine.mechanism, self.q, self.dq, self.ddq, self.geometry)

    def _smoothed(self, torque: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Smooth and differentiate; the derivatives of the raw torque are noise."""
        # Cut-off of a load before it is differentiated twice. Noise at 25 Hz would otherwise have
        # 600 times the weight of noise at 1 Hz. After averaging over long blocks, a motion's rate
        # may be below it.
        rate_hz = self.sample_rate_hz
        cutoff_hz = min(self.cutoff_hz, 5.0, 0.4 * rate_hz)
        # A stretch too short for the filter keeps its torque, with rates of zero.
        smooth, rate, curvature = torque.copy(), np.zeros_like(torque), np.zeros_like(torque)
        for stretch in self.segments():
            if stretch.stop - stretch.start >= shortest(rate_hz, cutoff_hz):
                smooth[stretch] = low_pass(torque[stretch], rate_hz, cutoff_hz)
                rate[stretch] = derivative(smooth[stretch], rate_hz, 1)
                curvature[stretch] = derivative(smooth[stretch], rate_hz, 2)
        return smooth, rate, curvature

    def loaded(self, body: NDArray, limb: NDArray) -> "Motion":
        """Return the run with the loads of rigid bodies.

        Parameters
        ----------
        body : (p,) array
            Inertial parameters of everything behind the drive trains.
        limb : (p,) array
            Inertial parameters of the wearer's limb alone.
        """
        # numpy multiplies one matrix twenty times as fast as a stack of matrices.
        flat = self.load_columns.torque.reshape(-1, len(body))
        load, limb_load = ((flat @ X).reshape(self.q.shape) for X in (body, limb))
        # Loads from measured torques would bring their noise to both sides of a regression.
        motion = replace(self, load=load, limb_load=limb_load, body=body, limb_body=limb)
        # The kinematics are the same, and so are the cached columns.
        motion.__dict__.update(load_columns=self.load_columns, columns_known=self.columns_known)
        return motion

    def with_readings_between(self) -> "Motion":
        """Return the run with cuff forces and temperatures at every sample.

        They are read less often than angles: without interpolation most averages would be NaN.
        """
        read = None if self.temperature is None else self.interpolated_temperature
        return replace(self, forces=self.held_forces, temperature=read)

    def with_state(self, q: NDArray, dq: NDArray, ddq: NDArray) -> "Motion":
        """Return the same run with other kinematics, as a corrected measurement has.

        Parameters
        ----------
        q, dq, ddq : (n, J) array
            Angle, velocity and acceleration; rad, rad/s and rad/s².
        """
        motion = replace(self, q=q, dq=dq, ddq=ddq)
        # The torques are the same, and smoothing them again costs more than the correction.
        kept = ["transmitted", "interpolated_temperature", "held_forces"]
        if self.limb_load is not None:
            kept.append("on_limb")
        cached = vars(self)
        vars(motion).update({name: cached[name] for name in kept if name in cached})
        return motion


class Piece(NamedTuple):
    """Part of a run: some samples and their neighbours."""

    motion: Motion
    core: slice
    """The samples of the piece; the others are its margin."""
    before: int
    """Samples of the motion's first segment that precede the motion."""


def geometry_of(metadata: dict[str, Any], default: Geometry | None = None) -> Geometry:
    """Return the recording's geometry, completed by ``default``.

    Parameters
    ----------
    metadata : dict
        Metadata of a recording or motion.
    default : Geometry, optional
        Without it, gravity acts on revolute joints, and prismatic joints are level.
    """
    stated = metadata.get("geometry", {}).items()
    known = {key: value for key, value in stated if key in Geometry.__dataclass_fields__}
    slides = all(joint.kind == "prismatic" for joint in joints_of(metadata))
    return replace(default or (Geometry(gravity_m_s2=0.0) if slides else Geometry()), **known)


def _period(table: Table) -> float | None:
    """Return the period of a recording's motion, s.

    None if it is unknown, or much longer than the recording.
    """
    # Least number of samples in a period.
    shortest_period = 4
    # Ratio of period to recording above which the period is ignored.
    ignored_period = 10
    period_s, rate_hz = table.metadata.get("period_s"), float(table.metadata["sample_rate_hz"])
    if period_s is None or period_s * rate_hz > ignored_period * len(table.frame):
        return None
    if period_s * rate_hz < shortest_period:
        raise InputError(
            f"{table.path or 'recording'}: period_s is {period_s:g} s, at {rate_hz:g} Hz less than"
            f" {shortest_period} samples, expected the period of the excitation; correct or"
            " remove it"
        )
    return float(period_s)


def motion_from_table(table: Table, default_geometry: Geometry | None = None) -> Motion:
    """Return the motion in a ``motion/1`` table.

    Parameters
    ----------
    table : Table
        n rows.
    default_geometry : Geometry, optional
        For lengths that the recording's metadata lack, from exoid.toml; the paper's by default.

    Returns
    -------
    Motion
        n samples of J joints.
    """
    frame, metadata = table.frame, table.metadata
    joints = joints_of(metadata)

    def per_joint(quantity: str) -> NDArray:
        return np.array(frame[[joint.column(quantity) for joint in joints]], dtype=float, order="C")

    def if_there(quantity: str) -> NDArray | None:
        is_there = {joint.column(quantity) for joint in joints} <= set(frame.columns)
        return per_joint(quantity) if is_there else None

    # One that was not measured is zero here: a single NaN would spread through every filter. No
    # equation of such a joint is used.
    is_known = [joint.is_measured for joint in joints]
    force_columns = [f"{cuff}_force_{axis}_n" for cuff in CUFFS for axis in "xyz"]
    has_forces = set(force_columns) <= set(frame.columns)
    return Motion(
        time=np.array(frame["time_s"], dtype=float),
        q=per_joint("angle"),
        dq=per_joint("velocity"),
        ddq=per_joint("acceleration"),
        torque=np.where(is_known, per_joint("torque"), 0.0),
        segment=np.array(frame["segment"], dtype=np.int64),
        valid=np.array(frame["valid"], dtype=bool),
        run=metadata["run"],
        purpose=metadata["purpose"],
        sample_rate_hz=float(metadata["sample_rate_hz"]),
        period_s=_period(table),
        joints=tuple(joint.name for joint in joints),
        geometry=geometry_of(metadata, default_geometry),
        forces=frame[force_columns].to_numpy(float).reshape(-1, 4, 3) if has_forces else None,
        reference=if_there("reference"),
        measured_angle=if_there("angle_measured"),
        sequence=np.array(frame["sequence"], dtype=np.int64) if "sequence" in frame else None,
        temperature=if_there("temperature"),
        cutoff_hz=float(metadata["filter"]["cutoff_hz"]),
        file=Path(table.path).name if table.path else "",
        metadata=metadata,
    )
