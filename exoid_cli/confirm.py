"""The questions before a leg is moved."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.mechanics.trajectory import Trajectory
    from pipelines.settings import Experiment
    from pipelines.settings.acquire import RunSettings
    from pipelines.settings.rig import RigSettings
    from pipelines.workflow.graph import Step

YesOption = Annotated[bool, typer.Option("--yes", help="Do not ask before a real rig is moved.")]


def confirm(
    rig: "RigSettings",
    run: "RunSettings",
    trajectory: Path,
    motion: "Trajectory",
    sample_rate_hz: float,
) -> None:
    """Show what will be moved and the limits in force, and ask; raise InputError unless the answer
    is yes."""
    import numpy as np

    from pipelines.acquisition.safety.limits import HOLD_SAMPLES

    _refuse_nobody_to_ask(
        f"run {run.name} moves somebody, which wants to be confirmed on a terminal"
    )
    seconds = min(run.duration_s, motion.period_s or run.duration_s)
    angles, speeds = motion.at(np.arange(0.0, seconds, 1.0 / sample_rate_hz))[:2]
    # On the terminal in every mode: who answers must have seen it.
    lines = [
        f"Run {run.name} moves somebody on the rig {rig.name} along {trajectory} for"
        f" {run.duration_s:g} s:"
    ]
    for j, drive in enumerate(rig.drive):
        angle, speed = angles[:, j], abs(speeds[:, j]).max()
        low, high = drive.angle_rad
        lines.append(
            f"  {drive.joint:<5} {angle.min():+.3f} to {angle.max():+.3f} rad at up to {speed:.3f}"
            f" rad/s; limits {low:+g} to {high:+g} rad, {drive.speed_rad_s:g} rad/s,"
            f" {drive.torque_nm:g} N·m"
        )
    cuffs = (
        f"{rig.safety.cuff_force_n:g} N on {len(rig.sensor)} cuff sensors"
        if rig.sensor
        else "none on the cuffs"
    )
    lines.append(
        f"  force {cuffs}; ramps of {rig.safety.ramp_s:g} s or longer lead in and out; Ctrl-C"
        " stops it"
    )
    stop_s = max(drive.speed_rad_s for drive in rig.drive) / rig.safety.deceleration_rad_s2
    lines.append(
        f"  a stop takes up to {stop_s:.2g} s, then the drives hold for"
        f" {HOLD_SAMPLES / sample_rate_hz:.2g} s before their torque is taken away"
    )
    lines.append(
        f"  stopped after {rig.safety.watchdog_s:g} s of silence, or"
        f" {rig.safety.following_error_rad:g} rad from a set-point"
    )
    console.err.print("\n".join(lines), markup=False, soft_wrap=True)
    _ask("Is everybody ready, and the emergency stop at hand?", f"run {run.name}")


def ask_before(experiment: "Experiment", step: "Step", *, yes: bool) -> tuple[str, ...]:
    """Ask before a step that would move a real rig though nobody named its run; return what its
    command is told."""
    from pipelines.settings.rig import load_rig

    if step.stage != "acquire" or step.run is None:
        return ()
    if yes:
        return ("--yes",)
    run = experiment.run_named(step.run)
    # Before somebody is moved, the command itself asks, and tells the limits.
    if run.run == "exo_alone" and not load_rig(experiment.file(experiment.acquire.rig)).embedded:
        _refuse_nobody_to_ask(
            f"run {run.name} moves the empty machine, which wants to be confirmed on a terminal"
        )
        console.err.print(
            f"Run {run.name} moves the machine for {run.duration_s:g} s.",
            markup=False,
            soft_wrap=True,
        )
        _ask("Is nobody in the machine, and the emergency stop at hand?", f"run {run.name}")
    return ()


def confirm_move() -> None:
    """Ask whether a check may move the leg; raise InputError unless the answer is yes."""
    _refuse_nobody_to_ask("--move moves the leg, which wants to be confirmed on a terminal")
    console.err.print(
        "\nIf all registers are right, the drives will be enabled and move both joints by 0.05 rad"
        " to and fro, the hip once in 4 s, the knee twice as fast. Keep the emergency stop in your"
        " hand; if the wrong joint moves faster, press it: the drives are swapped.",
        markup=False,
    )
    _ask("Is nobody in the machine, and everybody ready?", "--move")


def _refuse_nobody_to_ask(why: str) -> None:
    from pipelines.errors import InputError

    if not _somebody_sees_and_answers():
        raise InputError(f"{why}; give --yes where a script starts it; nothing was moved")


def _somebody_sees_and_answers() -> bool:
    # Where what is asked goes to a file, a terminal's yes is no answer to it.
    return sys.stdin.isatty() and sys.stderr.isatty()


def _forget_what_was_typed() -> None:
    """Leave nothing on the terminal that was typed before the question, and so is no answer to
    it."""
    if sys.platform == "win32":
        import msvcrt

        while msvcrt.kbhit():
            msvcrt.getwch()
    else:
        import termios

        termios.tcflush(sys.stdin, termios.TCIFLUSH)


def _ask(question: str, what: str) -> None:
    from pipelines.errors import InputError

    _forget_what_was_typed()
    console.err.print(f"{question} [y/N] ", markup=False, end="")
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise InputError(f"{what} was not confirmed; nothing was moved")
