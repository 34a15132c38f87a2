"""A small slow movement by the drives, recorded and watched like every run."""

import json
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.acquisition.acquire import acquire
from pipelines.acquisition.check.finding import Finding
from pipelines.acquisition.progress import Progress
from pipelines.contracts import RECORDING
from pipelines.errors import DeviceError, ExoidError, InputError, SettingsError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import RigSettings

AMPLITUDE_RAD = 0.05
PERIOD_S = 4.0
"""Period of the hip; the knee moves twice as fast, which distinguishes their answers."""
GAIN = 0.25
"""Largest deviation of the ratio of angle and set-point from one."""
LEAST_CORRELATION = 0.2
"""Least correlation of torque and speed that shows the torque's sign."""


@dataclass(frozen=True)
class Answer:
    """The answer of a joint to its set-points."""

    joint: str
    gain: float
    """Ratio of angle and set-point."""
    delay_s: float
    torque_with_speed: float
    """Correlation of torque with speed; friction makes it positive."""


def refuse_far_from_zero(angles: Sequence[float]) -> None:
    """Refuse to enable drives with untested signs away from zero, where a wrong sign is dangerous.

    Raises
    ------
    SettingsError
        Names a joint and its angle.
    """
    # Largest angle at the start: a drive of wrong sign leaps by twice that when it is enabled.
    near_zero_rad = 0.1
    for joint, angle in zip(("hip", "knee"), angles, strict=True):
        if abs(angle) > near_zero_rad:
            raise SettingsError(
                f"--move: the {joint} stands at {angle:.3f} rad, expected within ±{near_zero_rad:g}"
                " rad, as a drive of wrong sign leaps; let the leg hang straight, or add --by-hand"
            )


def move_by_drives(
    rig: RigSettings, start: Sequence[float], rate_hz: float, run: str
) -> tuple[list[Answer], list[Finding]]:
    """Move each joint a little to and fro, and check its answer.

    Parameters
    ----------
    rig : RigSettings
        With the addresses of the devices; the movement has tighter limits.
    start : (J,) sequence
        Angles of the leg, rad.
    run : str
        ``exo_alone`` or ``with_human``.
    """
    settings = RunSettings(name="guided", run=run, purpose="train", duration_s=2 * PERIOD_S)
    progress: list[Progress] = []
    try:
        with _folder() as folder:
            names = "rig.toml", "excitation.toml", "guided.parquet"
            rig_file, excitation, output = (folder / name for name in names)
            rig_file.write_text(_toml_file(_tight(rig, start)))
            excitation.write_text(_toml_file(_motion(start)))
            acquire(rig_file, settings, excitation, output, rate_hz, report=progress.append)
            table = RECORDING.read(output)
    except DeviceError as error:
        return [], [
            Finding("rig", f"the guided movement was stopped: {error}"),
            *_check_stopped(rig, progress),
        ]
    frame, recorded_hz = table.frame, table.metadata["sample_rate_hz"]
    reference = _sent(np.asarray(frame["time_s"], float), start)
    answers, findings = [], list[Finding]()
    for j, drive in enumerate(rig.drive):
        columns = {
            name: np.asarray(frame[f"{drive.joint}_{name}"], float)
            for name in ("angle_rad", "torque_nm")
        }
        gains, delay = _answer(columns["angle_rad"], reference, recorded_hz)
        # In the sense in which the angle counts, which may be against the set-point. Speeds from
        # noisy angles would weaken the correlation.
        speed = np.gradient(reference[:, j]) * recorded_hz * np.sign(gains[j])
        torque = float(np.corrcoef(columns["torque_nm"], speed)[0, 1])
        answers.append(Answer(drive.joint, float(gains[j]), delay, torque))
        findings += _check_answer(rig, j, gains, torque)
    return answers, findings


@contextmanager
def _folder() -> Iterator[Path]:
    """Make a folder for the duration of the block; it is kept if an error names a file in it."""
    folder = Path(tempfile.mkdtemp(prefix="exoid-check-"))
    try:
        yield folder
    except (ExoidError, KeyboardInterrupt) as error:
        # A refused movement has no samples; the error of a stopped one names its samples, if any.
        if isinstance(error, InputError) or str(folder) not in str(error):
            shutil.rmtree(folder)
        raise
    shutil.rmtree(folder)


def _tight(rig: RigSettings, start: Sequence[float]) -> dict[str, Any]:
    """Return the rig's settings with limits around the start, within those with a person."""
    # Distance beyond the movement at which it is stopped, within the rig's own limits.
    room_rad = 0.1
    speed_rad_s = 1.0
    # Limits with a wearer are the tighter ones, and nothing of this rig is tested yet.
    room, careful = AMPLITUDE_RAD + room_rad, rig.in_force("with_human")
    drives = tuple(
        drive.model_copy(
            update={
                "angle_rad": (
                    max(drive.angle_rad[0], angle - room),
                    min(drive.angle_rad[1], angle + room),
                ),
                "speed_rad_s": min(drive.speed_rad_s, speed_rad_s),
            }
        )
        for drive, angle in zip(careful.drive, start, strict=True)
    )
    # The file is written elsewhere, so relative paths in it must become absolute.
    lines = {name: line.with_files_in(Path.cwd()) for name, line in rig.line.items()}
    # Not embedded: the virtual rig runs already, and a second one would be another machine.
    tight = careful.model_copy(update={"drive": drives, "line": lines, "embedded": False})
    # Without default values: a default host would contradict a line.
    return tight.model_dump(mode="json", exclude_unset=True, exclude_none=True)


def _motion(start: Sequence[float]) -> dict[str, Any]:
    return {
        "unit": "rad",
        "omega_rad_s": 2 * np.pi / PERIOD_S,
        "theta0_rad": list(start),
        # Sines alone, so that the movement begins and ends where the leg stands.
        "a": [[AMPLITUDE_RAD, 0.0], [0.0, AMPLITUDE_RAD]],
        "b": [[0.0, 0.0], [0.0, 0.0]],
    }


def _sent(t: NDArray, start: Sequence[float]) -> NDArray:
    """Return the sent set-points (n, J) rad at times (n,) s; those of a file may be scaled."""
    phase = 2 * np.pi / PERIOD_S * t
    return np.array(start) + AMPLITUDE_RAD * np.column_stack([np.sin(phase), np.sin(2 * phase)])


def _toml_file(settings: dict[str, Any]) -> str:
    return "".join(f"{key} = {_toml(value)}\n" for key, value in settings.items())


def _toml(value: Any) -> str:
    """Return a value as TOML on one line, which equals JSON except for tables."""
    if isinstance(value, dict):
        return (
            "{" + ", ".join(f"{json.dumps(key)} = {_toml(one)}" for key, one in value.items()) + "}"
        )
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value)


def _answer(angle: NDArray, reference: NDArray, rate_hz: float) -> tuple[NDArray, float]:
    """Fit angle(t) = gains @ reference(t - delay) + constant; return gains (J,) and delay (s)."""
    longest_delay_s = 0.3
    fits = []
    # A quarter of the rows at most, so that enough remain for the fit.
    for lag in range(max(1, min(round(longest_delay_s * rate_hz), len(angle) // 4))):
        # Both joints' set-points: a joint that follows the other's shows exchanged angles.
        Y = np.column_stack([reference[: len(reference) - lag], np.ones(len(reference) - lag)])
        values = np.linalg.lstsq(Y, angle[lag:], rcond=None)[0]
        fits.append((float(np.mean((angle[lag:] - Y @ values) ** 2)), lag, values[:-1]))
    _, lag, gains = min(fits, key=lambda fit: fit[:2])
    return gains, lag / rate_hz


def _check_answer(rig: RigSettings, j: int, gains: NDArray, torque: float) -> Iterator[Finding]:
    drive, other = rig.drive[j], rig.drive[1 - j]
    name, where = f"drive {drive.joint}", f"map.drive.{drive.map}"
    # Exchanged angles first: they, too, do not follow their own set-point.
    gain, cross_gain = gains[j], gains[1 - j]
    if abs(gain) < GAIN and abs(cross_gain) > 1.0 - GAIN:
        yield Finding(
            name,
            f"its angle follows the set-point of drive {other.joint}: the angles are swapped;"
            " exchange host, port and unit of the two in the rig file",
            "angle",
        )
    elif abs(gain) < GAIN:
        yield Finding(
            name,
            f"its angle does not follow its set-point (gain {gain:.2f}); is it enabled?",
        )
    elif gain < 0:
        yield Finding(
            name,
            f"its angle goes against its set-point ({gain:.2f} as far): correct the sign of"
            f" {where}.read.angle.scale or {where}.write.reference.scale (--by-hand)",
            "angle",
        )
    elif abs(gain - 1.0) > GAIN:
        yield Finding(
            name,
            f"its angle goes {gain:.3g} times as far as its set-point: unit or scale of"
            f" {where}.read.angle and {where}.write.reference differ; correct the wrong one",
            "angle",
        )
    if abs(gain) >= GAIN and torque < -LEAST_CORRELATION:
        yield Finding(
            name,
            f"its torque goes against its speed (correlation {torque:.2f}), opposite to friction;"
            f" change the sign of {where}.read.current.scale",
            "current",
        )


def _check_stopped(rig: RigSettings, progress: Sequence[Progress]) -> Iterator[Finding]:
    """Check the answers before a movement was stopped."""
    # Least movement of a set-point for a check of the answer.
    seen_rad = 0.002
    rows = [report.row for report in progress if report.row is not None]
    for j in range(len(rig.drive)):
        reference = np.array([row.drives[j].reference for row in rows])
        angle = np.array([row.drives[j].angle for row in rows])
        if len(rows) < 2 or np.ptp(reference) < seen_rad:
            continue
        away = reference - reference[0]
        gains = np.zeros(len(rig.drive))
        # Least squares through the start, for one joint alone: a short movement may not separate
        # the two.
        gains[j] = away @ (angle - angle[0]) / (away @ away)
        # A joint lags behind as it begins to move, and may then overshoot.
        if not -GAIN <= gains[j] <= 2.0:
            yield from _check_answer(rig, j, gains, 0.0)
