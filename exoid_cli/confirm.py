"""The questions that a person at the terminal answers before a leg is moved, and during a check."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from exoid_cli.console import console
from pipelines.errors import InputError

if TYPE_CHECKING:
    from pipelines.mechanics.trajectory import Trajectory
    from pipelines.settings import Experiment
    from pipelines.settings.acquire import RunSettings
    from pipelines.settings.rig import RigSettings
    from pipelines.workflow.graph import Step


def confirm(
    rig: "RigSettings",
    run: "RunSettings",
    trajectory: Path,
    motion: "Trajectory",
    sample_rate_hz: float,
) -> None:
    """Show the motion and the limits in force, and ask; any answer but yes is an InputError."""
    from pipelines.acquisition.safety.limits import HOLD_SAMPLES

    _require_terminal(f"run {run.name} moves a person")
    lines = _motion_in_words("a person", rig, run, trajectory, motion, sample_rate_hz)
    cuffs = "none on the cuffs"
    if rig.sensor:
        cuffs = f"{rig.safety.cuff_force_n:g} N on {len(rig.sensor)} cuff sensors"
    # From the highest speed of any drive, at the deceleration of a stop.
    stop_s = max(drive.speed_rad_s for drive in rig.drive) / rig.safety.deceleration_rad_s2
    lines += [
        f"  force {cuffs}; ramps of {rig.safety.ramp_s:g} s or longer lead in and out; Ctrl-C"
        " stops it",
        f"  a stop takes up to {stop_s:.2g} s, then the drives hold for"
        f" {HOLD_SAMPLES / sample_rate_hz:.2g} s before their torque is taken away",
        f"  stopped after {rig.safety.watchdog_s:g} s of silence, or"
        f" {rig.safety.following_error_rad:g} rad from a set-point",
    ]
    # In every mode, --quiet included: who answers must have seen the limits.
    _print("\n".join(lines))
    _ask("Is everybody ready, and the emergency stop at hand?", f"run {run.name}")


def _motion_in_words(
    who: str,
    rig: "RigSettings",
    run: "RunSettings",
    trajectory: Path,
    motion: "Trajectory",
    sample_rate_hz: float,
) -> list[str]:
    """Return lines that say how a run moves each joint, and within which limits."""
    import numpy as np

    # An excitation repeats, so one period has its extremes.
    seconds = min(run.duration_s, motion.period_s or run.duration_s)
    angles, velocities = motion.at(np.arange(0.0, seconds, 1.0 / sample_rate_hz))[:2]
    lines = [
        f"Run {run.name} moves {who} on the rig {rig.name} along {trajectory} for"
        f" {run.duration_s:g} s:"
    ]
    for j, drive in enumerate(rig.drive):
        angle, speed = angles[:, j], abs(velocities[:, j]).max()
        low, high = drive.angle_rad
        lines.append(
            f"  {drive.joint:<5} {angle.min():+.3f} to {angle.max():+.3f} rad at up to {speed:.3f}"
            f" rad/s; limits {low:+g} to {high:+g} rad, {drive.speed_rad_s:g} rad/s,"
            f" {drive.torque_nm:g} N·m"
        )
    return lines


def ask_before(experiment: "Experiment", step: "Step", *, yes: bool) -> tuple[str, ...]:
    """Ask before a step that moves a real rig in a run that was not named on the command line.

    Returns further arguments for its command.
    """
    from pipelines.mechanics.trajectory import read_trajectory
    from pipelines.settings.rig import load_rig
    from pipelines.settings.rig.recording_only import is_recording_only

    if step.stage != "acquire" or step.run is None:
        return ()
    if yes:
        return ("--yes",)
    run = experiment.run_named(step.run)
    path = experiment.file(experiment.acquire.rig)
    if is_recording_only(path):  # nothing moves by it
        return ()
    # Before a person is moved, the command itself asks, and shows the limits.
    rig = load_rig(path)
    if run.run == "exo_alone" and not rig.embedded:
        _require_terminal(f"run {run.name} moves the empty machine")
        trajectory, rate_hz = step.inputs[0], experiment.acquire.sample_rate_hz
        motion = read_trajectory(trajectory)
        who = "the empty machine"
        _print("\n".join(_motion_in_words(who, rig, run, trajectory, motion, rate_hz)))
        _ask("Is nobody in the machine, and the emergency stop at hand?", f"run {run.name}")
    return ()


def confirm_move() -> None:
    """Ask whether a check may move the leg; any answer but yes is an InputError."""
    _require_terminal("--move moves the leg")
    console.err.print(
        "\nIf all registers are right, the drives will be enabled and move both joints by 0.05 rad"
        " to and fro, the hip once in 4 s, the knee twice as fast. Keep the emergency stop in your"
        " hand; if the wrong joint moves faster, press it: the drives are swapped.",
        markup=False,
    )
    _ask("Is nobody in the machine, and everybody ready?", "--move")


class OperatorPrompt:
    """Prompts of a manual check; each waits for Enter."""

    def __init__(self) -> None:
        if not sys.stdin.isatty():
            raise InputError(
                "--by-hand: standard input is not a terminal, so no person can be asked; run it in"
                " a terminal"
            )

    async def ready(self, prompt: str) -> None:
        """Show a prompt and return once Enter is pressed; Ctrl-C still works meanwhile."""
        import asyncio

        console.err.print(f"\n{prompt}\nPress Enter when you begin.", markup=False)
        # Waiting in the loop, not in readline: the check goes on reading its devices meanwhile.
        entered, loop = asyncio.Event(), asyncio.get_running_loop()
        loop.add_reader(sys.stdin, entered.set)
        try:
            await entered.wait()
        finally:
            loop.remove_reader(sys.stdin)
        # An empty text is the end of input; Enter alone is a line break.
        if not sys.stdin.readline():
            raise InputError(
                "standard input ended before the check did; start it again in a terminal"
            )


def _require_terminal(why: str) -> None:
    if not _at_a_terminal():
        raise InputError(
            f"{why}: confirm it on a terminal, or give --yes in a script; nothing was moved"
        )


def _at_a_terminal() -> bool:
    # Both: a yes on a terminal does not answer a question that went to a file.
    return sys.stdin.isatty() and sys.stderr.isatty()


def _discard_typed_input() -> None:
    """Discard text typed before the question, which is no answer to it."""
    if sys.platform == "win32":
        import msvcrt

        while msvcrt.kbhit():
            msvcrt.getwch()
    else:
        import termios

        termios.tcflush(sys.stdin, termios.TCIFLUSH)


def _ask(question: str, action: str) -> None:
    _discard_typed_input()
    console.err.print(f"{question} [y/N] ", markup=False, end="")
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise InputError(f"{action} was not confirmed; nothing was moved")


def _print(text: str) -> None:
    console.err.print(text, markup=False, soft_wrap=True)
