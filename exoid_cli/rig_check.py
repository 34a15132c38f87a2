"""``exoid rig check``: compare a rig with its file."""

import sys
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from exoid_cli.confirm import OperatorPrompt, confirm_move
from exoid_cli.console import console
from exoid_cli.experiment_folder import in_experiment_folder, open_experiment, settings_in_force
from exoid_cli.options import ConfigOption

if TYPE_CHECKING:
    from pipelines.acquisition.check.latency import Latency
    from pipelines.acquisition.check.rate import Rate
    from pipelines.acquisition.check.survey import DeviceReport, RigReport


def check(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE", help="The rig's description.", show_default="that of exoid.toml"
        ),
    ] = None,
    config: ConfigOption = None,
    rate_hz: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            max=1e5,
            help="Samples a second that are wanted.",
            show_default="that of exoid.toml, else a virtual rig's own",
        ),
    ] = None,
    run: Annotated[
        Literal["exo_alone", "with_human"],
        typer.Option(help="Whether a person is in the machine; sensors' zeros need an empty one."),
    ] = "exo_alone",
    by_hand: Annotated[
        bool, typer.Option("--by-hand", help="Guide a manual test with the drives disabled.")
    ] = False,
    move: Annotated[
        bool,
        typer.Option(
            "--move", help="Then, if nothing is wrong, move each joint by 0.05 rad to and fro."
        ),
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Move without asking, for scripts.")] = False,
    trace: Annotated[
        bool, typer.Option("--trace", help="Print all bytes, sent (>) and received (<), to stderr.")
    ] = False,
) -> None:
    """Ask every device of a rig and say what is wrong; nothing moves without --move.

    \b
    Examples:
      exoid rig check
      exoid rig check rigs/real_time.toml --rate-hz 200
      exoid rig check rig.toml --by-hand
    """
    from pipelines.acquisition.check.check import check_rig, refuse_to_move_a_person
    from pipelines.errors import DeviceError

    # An imported recording that is damaged is no reason not to check the rig.
    if file is None:
        folder = open_experiment(config, problem="no rig file is given", allow_damaged=True)
        file = folder.experiment.file(folder.experiment.acquire.rig)
    # Outside an experiment a virtual rig has a rate of its own; a real one is only measured.
    if rate_hz is None and (config or in_experiment_folder()):
        rate_hz = settings_in_force(config).acquire.sample_rate_hz
    if run == "with_human":
        refuse_to_move_a_person(by_hand=by_hand, move=move)
    console.say(f"{file}: asking every device")
    if move and not yes:
        confirm_move()
    operator = OperatorPrompt() if by_hand else None
    show = partial(print, file=sys.stderr) if trace else None
    report = check_rig(file, rate_hz, run, operator, move=move, trace=show)
    console.emit(asdict(report))
    _show(report)
    for note in report.notes:
        console.note(note)
    if report.findings:
        count = len(report.findings)
        console.say("\nWhat is wrong")
        for finding in report.findings:
            console.say(f"- {finding}")
        raise DeviceError(
            f"{file}: {count} {'thing is' if count == 1 else 'things are'} not as the file says"
        )
    console.say("\nNothing is wrong.")


def _show(report: "RigReport") -> None:
    console.say("\nOne request at a time")
    rows = [(device.name, _identity(device), *_times(device.latency)) for device in report.devices]
    headings: tuple[str, ...]
    headings = ("device", "identity", "min ms", "median", "99 %", "max", "log scale")
    console.table(headings, rows, numbers=", ".join(headings[2:-1]))
    drives = [device for device in report.devices if "angle" in device.values]
    if drives:
        console.say(f"\nDrives, {'as they move' if report.recording_only else 'disabled'}")
        headings = ("", "angle rad", "rad/s", "current A", "°C", "samples/s", "clock s/s")
        console.table(headings, map(_drive, drives), numbers=", ".join(headings[1:]))
    sensors = [device for device in report.devices if "force_x" in device.values]
    if sensors:
        console.say("\nSensors, mean ± noise in N")
        headings = ("", "x", "y", "z", "samples/s")
        console.table(headings, map(_sensor, sensors), numbers=", ".join(headings[1:]))
    if report.moved:
        console.say("\nMoved by the drives")
        rows = [
            (a.joint, f"{a.gain:.3f}", f"{a.delay_s * 1e3:.0f}", f"{a.torque_with_speed:.2f}")
            for a in report.moved
        ]
        headings = ("joint", "angle per set-point", "delay ms", "torque-velocity correlation")
        console.table(headings, rows, numbers=", ".join(headings[1:]))
        console.note(
            "No movement shows the scale of the torque. Hold a known weight, see docs/rig-check.md."
        )
    for what, rate in (("all devices", report.together), ("the drives alone", report.drives_alone)):
        if rate:
            _show_rate(what, rate, report.rate_hz)


def _identity(device: "DeviceReport") -> str:
    if not device.connected:
        return "no connection"
    read = [(entry["found"], entry["expected"]) for entry in device.identity]
    wrong = [f"0x{value:04X}, expected 0x{due:04X}" for value, due in read if value != due]
    if wrong:
        return ", ".join(wrong)
    if device.latency is None:
        return "no answer"
    return "as expected" if device.identity else "none asked for"


def _times(latency: "Latency | None") -> tuple[str, ...]:
    if latency is None:
        return ("", "", "", "", "")
    numbers = (latency.min_ms, latency.median_ms, latency.p99_ms, latency.max_ms)
    return (*(f"{number:.2f}" for number in numbers), _small(latency.histogram))


def _small(histogram: tuple[int, ...]) -> str:
    """Draw a histogram on one line."""
    most = max(histogram)
    blocks = " ▁▂▃▄▅▆▇█"
    # Rounded up, so that a single slow answer is seen.
    return "".join(blocks[-(-count * (len(blocks) - 1) // most)] for count in histogram)


def _drive(device: "DeviceReport") -> list[Any]:
    read = ("angle", "velocity", "current", "temperature")
    values = [f"{device.values[name]:.3f}" if name in device.values else "" for name in read]
    return [device.name, *values, *_clock(device)]


def _sensor(device: "DeviceReport") -> list[Any]:
    axes = ("force_x", "force_y", "force_z")
    forces = [f"{device.values[axis]:.2f} ± {device.noise[axis]:.2f}" for axis in axes]
    return [device.name, *forces, _clock(device)[0]]


def _clock(device: "DeviceReport") -> tuple[str, str]:
    clock = device.clock
    if clock is None:
        return "", ""
    rates = (clock.counter_hz, ".1f"), (clock.clock_rate, ".4f")
    samples, clock_rate = (format(rate, form) if rate is not None else "" for rate, form in rates)
    return samples, clock_rate


def _show_rate(what: str, rate: "Rate", wanted_hz: float | None) -> None:
    wanted = f", wanted {wanted_hz:g}" if wanted_hz else ""
    console.say(f"\nCycles of {what}: {rate.cycles_hz:.0f} a second{wanted}")
    if wanted_hz:
        console.note(f"{rate.late:.1%} of them take longer than a sample")
    cycle = rate.cycle
    steps = len(cycle.histogram)
    ratio = cycle.max_ms / cycle.min_ms
    # The histogram's bins are equally wide in the logarithm of the duration.
    edges = [cycle.min_ms * ratio ** (k / steps) for k in range(steps + 1)]
    most = max(cycle.histogram)
    rows = [
        (f"{edges[k]:.2f} to {edges[k + 1]:.2f} ms", count, "█" * -(-count * 30 // most))
        for k, count in enumerate(cycle.histogram)
        if count
    ]
    console.table(("duration", "cycles", ""), rows, numbers="cycles")
