"""Draw a joint's residual against one variable: dots, and the mean at each value."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from pipelines.contracts.joint_units import unit_at
from pipelines.contracts.joints import the
from pipelines.diagnosis.dependence.explained_share import VARIABLES, Variable, knows, pooled, tone
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.evidence.observed_run import Run
from pipelines.plotting.style import BLUE, GREY, NOISE
from pipelines.signals.binned_mean import binned_mean


@dataclass(frozen=True)
class Against:
    """One joint's residuals along a variable, n usable blocks of some runs together."""

    label: str
    x: NDArray
    """(n,)."""
    parts: tuple[NDArray, ...]
    """(n,) bool each: blocks with a mean of their own, as the two directions of motion, or each run
    over time."""
    before: NDArray
    """(n,) N·m under the baseline."""
    after: NDArray
    """(n,) N·m under the extended model."""


def against(name: str, d: Diagnosis, joint: str, kinds: Sequence[str]) -> Against:
    """Return a joint's residuals of validation runs along a variable.

    Parameters
    ----------
    name : str
        Name of the variable, or ``tone``.
    d : Diagnosis
        With residuals before and after.
    joint : str
        Name of the joint.
    kinds : sequence of str
        Kinds of run to include.
    """
    j = d.baseline.joints.index(joint)
    variable = next((v for v in VARIABLES if v.name == name), None)
    chosen = [
        i
        for i, run in enumerate(d.validate)
        if run.motion.run in kinds and (variable is None or knows(variable, [run], j))
    ]
    runs = [d.validate[i] for i in chosen]

    def seen(i: int, residual: NDArray) -> NDArray:
        # A hum may lie above the cut-off that noisy angles require.
        return (d.validate[i].with_fast(residual) if variable is None else residual)[:, j]

    before, after = ([seen(i, e.residuals[i]) for i in chosen] for e in (d.before, d.after))
    if variable is None:
        # With named causes, the tone is that of the torque which they explain.
        label, x = _along_tone(
            runs, [b - a if d.causes else b for b, a in zip(before, after, strict=True)], j
        )
    else:
        label = (
            f"{_title(variable, d.baseline.joints, j)},"
            f" {unit_at(d.baseline.machine.joints[j].kind, variable.unit)}"
        )
        x = [np.asarray(variable.of(run, j)) for run in runs]
    return Against(
        label=label,
        x=pooled(runs, x, j),
        parts=_parts(variable, runs, j),
        before=pooled(runs, before, j),
        after=pooled(runs, after, j),
    )


def _parts(variable: Variable | None, runs: Sequence[Run], j: int) -> tuple[NDArray, ...]:
    if variable is not None and variable.by_direction:
        # A mean over both directions hides errors of
        # friction, which change sign with the direction.
        forward = pooled(runs, [run.state[1][:, j] > 0 for run in runs], j)
        return forward, ~forward
    if variable is not None and variable.name == "time":
        # Runs do not share a clock, so each has its own mean over time.
        number = pooled(runs, [np.full(len(run.time), i) for i, run in enumerate(runs)], j)
        return tuple(number == i for i in range(len(runs)))
    return (np.ones(int(sum(run.usable[:, j].sum() for run in runs)), dtype=bool),)


def _title(variable: Variable, joints: Sequence[str], j: int) -> str:
    joint = joints[1 - j if variable.name.startswith("other_") else j]
    titles = {
        "reversals": f"time since {the(joint)} reversed",
        "cuff_force": f"{joint} cuff torque",
        "temperature": f"{joint} motor's temperature",
        "time": "time since the run began",
        "phase": "phase of the excitation",
    }
    return titles.get(variable.name, f"{joint} {variable.name.removeprefix('other_')}")


def _along_tone(
    runs: Sequence[Run], residuals: Sequence[NDArray], j: int
) -> tuple[str, list[NDArray]]:
    """Fold time at the strongest tone in residuals (m,), each run from its tone's crest."""
    # ``tone`` reads column j of several; the others are copies that it does not read.
    wide = [np.repeat(e[:, np.newaxis], j + 1, axis=1) for e in residuals]
    frequency, *_ = tone(runs, wide, j)
    x = []
    for run, residual in zip(runs, residuals, strict=True):
        known = run.usable[:, j]
        turned = np.exp(-2j * np.pi * frequency * run.time)
        # The coefficient's angle is the phase at time zero, so that its crest comes to lie at zero.
        crest = np.angle(residual[known] @ turned[known]) / (2 * np.pi)
        x.append((frequency * run.time + crest + 0.5) % 1.0 - 0.5)
    return f"cycles of a tone of {frequency:.2f} Hz", x


def reach(*residuals: NDArray) -> float:
    """Return the height of a panel for residuals.

    Parameters
    ----------
    *residuals : (m,) arrays
        N·m.

    Returns
    -------
    float
        On either side of zero, N·m.
    """
    # A few outliers would flatten the rest.
    return 1.1 * max(
        (float(np.percentile(np.abs(e), 99.0)) for e in residuals if len(e)), default=1.0
    )


def draw(axis: Axes, seen: Against, floor: float, height: float, changed: bool) -> None:
    """Draw residuals before and, with named causes, after, on the band of the noise floor.

    Parameters
    ----------
    axis : Axes
        Where to draw.
    seen : Against
        Residuals along a variable, N·m.
    floor, height : float
        Noise floor, and height on either side of zero, N·m.
    changed : bool
        Whether causes are named.
    """
    axis.axhspan(-floor, floor, color=NOISE, alpha=0.5, lw=0)
    axis.axhline(0, color="black", lw=0.6)
    # More dots than about 2000 hide the shape, and take long to draw.
    step = max(1, len(seen.x) // 2000)
    if len(seen.x):
        # A few outliers would squeeze all other dots.
        low, high = np.percentile(seen.x, [0.2, 99.8])
        axis.set_xlim(low - 0.02 * (high - low) - 1e-9, high + 0.02 * (high - low) + 1e-9)
    kinds = [(seen.before, GREY, 0.6)] + [(seen.after, BLUE, 0.4)] * changed
    for residual, colour, alpha in kinds:
        style: dict[str, Any] = {"color": colour, "alpha": alpha, "rasterized": True}
        axis.plot(seen.x[::step], residual[::step], ".", ms=1.8, mew=0, **style)
    for residual, colour, _ in kinds:
        for part, line in zip(seen.parts, cycle(("-", "--", ":", "-."))):
            if part.any():
                x = seen.x[part]
                mean = binned_mean(x, residual[part], x.min(), x.max())
                axis.plot(*mean, line, color=colour, lw=2, marker="o", ms=3)
    axis.set_ylim(-height, height)
    axis.set_xlabel(seen.label)
