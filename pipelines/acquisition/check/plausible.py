"""Whether registers have possible values for a leg at rest."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.check.interpretation import remedy
from pipelines.acquisition.check.probe import Probe, Series
from pipelines.acquisition.check.turns import check_turns
from pipelines.acquisition.check.words import check_words
from pipelines.acquisition.machine.drive import Drive
from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.devices import DriveSettings
from pipelines.settings.rig.recording_only import RecordingRig

TINY, HUGE = 1e-20, 1e20
"""Range of credible magnitudes; other floats are misread words."""
SI = {
    "angle": " rad",
    "reference": " rad",
    "velocity": " rad/s",
    "current": " A",
    "temperature": " °C",
}


@dataclass(frozen=True)
class Expectation:
    """The possible values of a register at rest."""

    low: float = -HUGE
    high: float = HUGE
    words: str = ""
    """The range, as a clause of a sentence."""
    otherwise: str = "compare {where} with the device's manual"
    """Remedy where no other description of the register explains its values."""
    fastest: float = np.inf
    """Largest change a second."""

    def holds(self, values: NDArray) -> NDArray:
        """Return which values are possible.

        Parameters
        ----------
        values : (n,) array
            In SI units.

        Returns
        -------
        (n,) bool array
            True within the bounds.
        """
        return has_plausible_size(values) & (values >= self.low) & (values <= self.high)

    def leaps(self, values: NDArray, seconds: NDArray, period_s: float) -> bool:
        """Return whether values change faster than possible.

        Two answers that come soon after each other may be a period apart.

        Parameters
        ----------
        values : (n,) array
            In SI units.
        seconds : (n,) array
            When they were read, s.
        period_s : float
            Time between samples, s.
        """
        # Change of an angle between two samples that is allowed in addition to the speed limit.
        step_rad = 0.01
        # Misread words may be NaN, or so large that their difference overflows.
        with np.errstate(invalid="ignore", over="ignore"):
            longest = self.fastest * (np.diff(seconds) + period_s) + step_rad
            return bool((np.abs(np.diff(values)) > longest).any())


_ANYWHERE = Expectation(
    -LARGEST_ANGLE_RAD,
    LARGEST_ANGLE_RAD,
    f"beyond the {LARGEST_ANGLE_RAD:.4g} rad that a recording holds without turns = true",
)
"""The angles of a machine that exoid only reads."""


def check_registers(
    probe: Probe, series: Series, rig: RigSettings | RecordingRig
) -> Iterator[Finding]:
    """Yield findings about all registers except counter and clock.

    Parameters
    ----------
    probe : Probe
        The device.
    series : Series
        One answer or more.
    rig : RigSettings
        With the limits of the joints.

    Yields
    ------
    Finding
        Faults that are active, and values that are not possible at rest.
    """
    if isinstance(probe.part, Drive):
        yield from _check_faults(probe, probe.part, series)
        expected = _of_drive(probe.part.settings, probe.in_lockstep)
    elif isinstance(rig, RigSettings):
        expected = _of_sensor(rig)
    else:  # a machine that moves by itself may be anywhere that a recording holds
        turns = "angle" in series.block.names and series.block.registers["angle"].turn
        expected = {} if turns else dict.fromkeys(("angle", "reference"), _ANYWHERE)
    yield from _check_counter_words(probe, series)
    findings = list(check_words(probe, series, order=isinstance(rig, RecordingRig)))
    if isinstance(rig, RecordingRig) and not any(one.quantity == "angle" for one in findings):
        findings += check_turns(probe, series)
    yield from findings
    misread = {finding.quantity for finding in findings}
    for name in series.block.names:
        if name not in ("sequence", "time", "status") and name not in misread:
            yield from _check_register(probe, name, series, expected.get(name, Expectation()))


def _check_counter_words(probe: Probe, series: Series) -> Iterator[Finding]:
    """Yield a finding for each long value whose low word is the sample counter.

    Its high word alone gives a value nearly right, so only this shows that its address is wrong.
    """
    # New samples, each with the counter's step in the low word, that are no accident.
    enough = 20
    fresh = series.fresh
    if len(fresh) < enough or "sequence" not in series.block.names:
        return
    steps = np.diff(series.of("sequence")[fresh]) % 65536
    for name, register in series.block.registers.items():
        if name in ("sequence", "time") or register.registers == 1:
            continue
        low = series.raw(name)[fresh, -1 if register.word_order == "big" else 0]
        if (np.diff(low) % 65536 == steps).all():
            yield probe.finding(
                f"{name} has the sample counter as its low word; its address or word_order is"
                f" wrong, compare {probe.map_path}.read.{name} with the manual",
                name,
            )


def has_plausible_size(values: NDArray) -> NDArray:
    """Return which values are finite and of a credible magnitude.

    Parameters
    ----------
    values : (n,) array
        In SI units.

    Returns
    -------
    (n,) bool array
        True for zero, and for a size between ``TINY`` and ``HUGE``.
    """
    size = np.abs(values)
    return np.isfinite(values) & ((size == 0.0) | ((size > TINY) & (size < HUGE)))


def _of_drive(drive: DriveSettings, in_lockstep: bool) -> dict[str, Expectation]:
    # Largest current of a disabled drive, as a share of its joint's torque limit.
    torque_at_rest = 0.1
    # Largest speed of a leg that swings freely, as a multiple of its joint's limit.
    speed_at_rest = 2.0
    low, high = drive.angle_rad
    speed = speed_at_rest * drive.speed_rad_s
    current = torque_at_rest * drive.torque_nm / drive.torque_per_ampere
    return {
        "angle": Expectation(
            low,
            high,
            f"outside its limits {low:g} to {high:g} rad",
            "move the leg within its limits, or correct the encoder's zero ({where}.offset)",
            # In lockstep the host's clock is not that of the leg.
            fastest=np.inf if in_lockstep else speed,
        ),
        "velocity": Expectation(
            -speed, speed, f"expected less than {speed:g} rad/s of a leg at rest"
        ),
        "current": Expectation(
            -current,
            current,
            f"expected less than {current:.2g} A of a disabled drive",
            "does another master drive it? Else compare {where} with its manual",
        ),
        "temperature": Expectation(-20.0, 150.0, "expected -20 to 150 °C"),
    }


def _of_sensor(rig: RigSettings) -> dict[str, Expectation]:
    limit = rig.safety.cuff_force_n
    words = f"expected less than safety.cuff_force_n, {limit:g} N, of an unloaded cuff"
    return dict.fromkeys(("force_x", "force_y", "force_z"), Expectation(-limit, limit, words))


def _check_register(
    probe: Probe, name: str, series: Series, expected: Expectation
) -> Iterator[Finding]:
    # Largest angle of a leg outside its limits; beyond it, the register is misread.
    turn_rad = np.pi
    values, seconds = series.of(name), series.answered
    came = np.diff(seconds[series.fresh])
    period_s = float(np.median(came)) if len(came) else 0.0
    good, leaps = expected.holds(values), expected.leaps(values, seconds, period_s)
    if good.all() and not leaps:
        return
    value = float(values[~good][0]) if not good.all() else float(values[-1])
    unit, where = SI.get(name, " N"), f"{probe.map_path}.read.{name}"
    why = expected.words if not good.all() else "and leaps from one reading to the next"
    if not has_plausible_size(values).all():
        why = "which is not a credible value"
    # A leg may stand a little outside its limits; that is no misread register.
    misread = name != "angle" or leaps or abs(value) > turn_rad or not np.isfinite(value)

    def is_possible(v: NDArray) -> bool:
        return bool(expected.holds(v).all() and not expected.leaps(v, seconds, period_s))

    mended = remedy(name, unit, where, series, is_possible) if misread else None
    todo = mended or expected.otherwise.format(where=where)
    yield probe.finding(f"{name} reads {value:.4g}{unit}, {why}; {todo}", name)


def _check_faults(probe: Probe, drive: Drive, series: Series) -> Iterator[Finding]:
    if "status" not in series.block.registers:
        return
    status = int(series.of("status")[-1])
    bits = drive.map.active_faults(status)
    if bits:
        yield probe.finding(
            f"reports a fault (status 0x{status:04X}, fault bits {bits}); see the drive's manual"
            f" and clear it, or correct {probe.map_path}.fault_mask",
            "status",
        )
