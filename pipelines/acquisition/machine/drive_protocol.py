"""Exchanges with a drive before a run and at its end: checks, disabling, fault reset."""

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress

from pipelines.acquisition.machine.drive import Drive
from pipelines.acquisition.modbus.wraparound import RATE_TOLERANCE, keeps_time
from pipelines.errors import DeviceError, Refused, SettingsError

EMPTYING_S = 10.0
"""Longest time to empty a drive's queue: thousands of records, a few with each read."""
WATCH_S = 0.5
"""How long an enabled drive is watched before a run for another program that drives it."""


async def is_driven(drive: Drive) -> bool:
    """Watch a drive for ``WATCH_S``; return whether another program drives it.

    A drive that reports that it is disabled is not driven. Nothing is written: a torque that is
    taken away comes back with the other program's next set-point.
    """
    # Pause between two readings while it is watched.
    watch_pause_s = 0.05
    # Change of its angle within WATCH_S that means that another program drives it.
    driven_rad = 0.005
    values = await drive.read_values()
    if drive.map.enabled_mask and not drive.says_enabled(int(values["status"])):
        return False
    until = time.monotonic() + WATCH_S
    first_words, first_angle = await _set_point_and_angle(drive)
    while time.monotonic() < until:
        await asyncio.sleep(watch_pause_s)
        words, angle = await _set_point_and_angle(drive)
        # Written so that a NaN counts as driven.
        if words != first_words or not abs(angle - first_angle) <= driven_rad:
            return True
    return False


async def _set_point_and_angle(drive: Drive) -> tuple[list[int] | None, float]:
    """Return the words that were written last, None where they cannot be read, and the angle."""
    values = await drive.read_values()
    block = drive.write_block
    try:
        words = await drive.device.read(block.address, block.count)
    except Refused:  # not every drive lets its written registers be read
        words = None
    return words, values["angle"]


async def disable(drive: Drive, angle: float, *, in_motion: bool = False) -> None:
    """Take a drive's torque away and verify it; its leg is at, or was sent to, ``angle`` (rad).

    Raises
    ------
    DeviceError
        The drive did not answer, or still reports that it is enabled.
    """
    await drive.write_idle(drive.map.disable, angle, in_motion=in_motion)
    if drive.map.enabled_mask:
        await _wait_for(drive, lambda status: not drive.says_enabled(status), "to disable")


async def make_idle(drive: Drive) -> bool:
    """Disable a drive before a run; return whether it reported that it was enabled."""
    values = await drive.read_values()
    mask = drive.map.enabled_mask
    was_enabled = bool(mask) and drive.says_enabled(int(values["status"]))
    await disable(drive, values["angle"])
    return was_enabled


async def reset_fault(drive: Drive) -> None:
    """Clear a drive's fault; send nothing where it reports none.

    Raises
    ------
    SettingsError
        The rig file has no control word for it.
    DeviceError
        The drive keeps its fault.
    """
    values = await drive.read_values()
    mask = drive.map.fault_mask
    if not int(values.get("status", 0)) & mask:
        return
    if drive.map.fault_reset is None:
        raise SettingsError(
            f"map.drive.{drive.settings.map}.fault_reset: missing, but {drive.device.label} reports"
            " a fault; give the control word that resets it"
        )
    try:
        await drive.write_idle(drive.map.fault_reset, values["angle"])
        await _wait_for(drive, lambda status: not status & mask, "to reset its fault")
    except DeviceError:
        with suppress(DeviceError):  # the first error is the cause
            await drive.write_idle(drive.map.disable, values["angle"])
        raise
    # A reset word that stays in the register could clear a later fault unseen.
    await drive.write_idle(drive.map.disable, values["angle"])


async def _wait_for(drive: Drive, is_done: Callable[[int], bool], purpose: str) -> None:
    """Read the status word until it confirms a control word."""
    # Pause between two readings of a status word that has not changed yet.
    status_pause_s = 0.002
    until = time.monotonic() + drive.control_s
    while True:
        status = await drive.read_status()
        if is_done(status):
            return
        if time.monotonic() > until:
            raise DeviceError(
                f"{drive.device.label}: was sent the word {purpose}, but its status word is still"
                f" 0x{status:04X} after {drive.control_s:g} s (safety.control_s); see its manual"
            )
        await asyncio.sleep(status_pause_s)


async def refuse_other_rate(drive: Drive, rate_hz: float, setting: str) -> None:
    """Refuse a drive that samples at another rate, by this computer's clock or by its own.

    Raises
    ------
    DeviceError
        Names the ``setting`` with the expected rate.
    """
    # How long a drive's counter and clock are watched before a run.
    rate_s = 0.5
    asked = time.perf_counter()
    first = await drive.look()
    answered = time.perf_counter()
    await asyncio.sleep(rate_s)
    asked_again = time.perf_counter()
    last = await drive.look()
    # The time between the two samples is between these, whenever each was latched.
    longest, shortest = time.perf_counter() - asked, asked_again - answered
    samples, seconds = last.sequence - first.sequence, last.time - first.time
    # One sample more or less at either end; the latency of the replies is allowed for.
    fewest = shortest * rate_hz * (1.0 - RATE_TOLERANCE) - 1.0
    most = longest * rate_hz * (1.0 + RATE_TOLERANCE) + 1.0
    if not fewest <= samples <= most:
        raise DeviceError(
            f"{drive.device.label}: its sample counter goes up by"
            f" {samples / (0.5 * (shortest + longest)):.4g} a second, expected {rate_hz:g};"
            f" correct {setting}, or the rate in the drive; nothing was moved"
        )
    if not keeps_time(samples, seconds, rate_hz):
        raise DeviceError(
            f"{drive.device.label}: its clock went on by {seconds:.6f} s while its counter went"
            f" on by {samples} samples of {1.0 / rate_hz:.6f} s; correct the unit of time in"
            f" the rig file, or {setting}; nothing was moved"
        )


async def empty_recorder(drive: Drive) -> None:
    """Discard all samples that a drive has recorded so far, before anything moves.

    Raises
    ------
    DeviceError
        New records come faster than they can be read.
    """
    until = time.monotonic() + EMPTYING_S
    while not await drive.forget_records():
        if time.monotonic() > until:
            raise DeviceError(
                f"{drive.device.label}: its queue is not empty after {EMPTYING_S:g} s of reading"
                " without a pause; raise the speed of its line, give each drive its own line, or"
                " let it record less often (record_rate_hz)"
            )
