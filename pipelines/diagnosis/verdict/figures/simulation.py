"""Draw replayed simulation and measurement where the baseline is worst."""

from typing import Any

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipelines.contracts.joints import either
from pipelines.contracts.verdict import Verdict
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.fit.validation import ValidationResult
from pipelines.diagnosis.verdict.figures.shared import heading
from pipelines.diagnosis.verdict.worst_stretch import Stretch, simulated_error, worst_stretch
from pipelines.plotting.style import BLUE, GREY, NOISE
from pipelines.wording.label import number


def figure(d: Diagnosis, verdict: Verdict) -> Figure:
    """Draw angle, angle error, torque and torque error of each measured joint, a column each."""
    joints, stretch = d.baseline.machine.measured_names, worst_stretch(d)
    places = d.baseline.machine.measured_indices
    drawn, axes = plt.subplots(
        4,
        len(joints),
        figsize=(max(5.2 * len(joints), 8.0), 7.6),  # the titles need 8 inches
        sharex=True,
        squeeze=False,
        height_ratios=[2, 1.3, 2, 1.3],
    )
    models = [("rigid body and friction", GREY, d.before)]
    models += [("with the causes", BLUE, d.after)] if d.causes else []
    for j, joint, column in zip(places, joints, axes.T, strict=True):
        effort = d.baseline.machine.joint(joint).effort
        _measured(column[0], column[2], d, stretch, j)
        column[1].axhline(0, color="black", lw=0.6)
        column[3].axhspan(
            -d.floor.rms[j], d.floor.rms[j], color=NOISE, alpha=0.6, lw=0, label="noise floor"
        )
        column[0].set_title(
            f"{joint}: 1 s simulations drift {_drift(verdict, joint)}", loc="left", fontsize=9
        )
        column[2].set_title(
            f"{joint}: {effort} is off by {_off(d, verdict, joint)}", loc="left", fontsize=9
        )
        column[-1].set_xlabel("time, s")
    for name, colour, validated in models:
        _angles(axes[0], axes[1], validated, d, stretch, name, colour)
        _torques(axes[2], axes[3], validated, d, stretch, colour)
    # A simulation that runs away would flatten all others.
    for error in axes[1]:
        low, high = error.get_ylim()
        error.set_ylim(max(low, -500.0), min(high, 500.0))
    angle, torque = (
        either(verdict.units[joint][quantity] for joint in joints)
        for quantity in ("angle", "torque")
    )
    where = either(joint.place for joint in d.baseline.machine.joints)
    push = either(joint.effort for joint in d.baseline.machine.joints)
    axes[0, 0].set_ylabel(f"{where}, {angle}")
    axes[1, 0].set_ylabel(f"{where} error, m{angle}")
    axes[2, 0].set_ylabel(f"{push}, {torque}")
    axes[3, 0].set_ylabel(f"{push} error, {torque}")
    lines = [axis.get_legend_handles_labels() for axis in (axes[0, 0], axes[3, 0])]
    drawn.legend(
        [h for some, _ in lines for h in some],
        [w for _, some in lines for w in some],
        loc="upper left",
        bbox_to_anchor=(0.01, 0.965),
        ncols=4,
    )
    file = d.validate[stretch.run].motion.file
    heading(drawn, f"Simulated and measured where the baseline is furthest off ({file})")
    axes[0, 0].set_xlim(stretch.begin, stretch.end)
    drawn.align_ylabels()
    drawn.tight_layout(rect=(0, 0, 1, 0.96))
    return drawn


def _drift(verdict: Verdict, joint: str) -> str:
    before = verdict.baseline_simulation_rmse_rad[joint]
    after = verdict.extended_simulation_rmse_rad[joint]
    if before is None:
        return "(cannot be simulated)"
    unit = f"m{verdict.units[joint]['angle']} rms"
    if not verdict.causes:
        return f"{1e3 * before:.1f} {unit}"
    if after is None:
        return f"{1e3 * before:.1f} {unit} → cannot be simulated"
    return f"{1e3 * before:.1f} → {1e3 * after:.1f} {unit}"


def _off(d: Diagnosis, verdict: Verdict, joint: str) -> str:
    machine = d.baseline.machine
    words = number(machine, verdict.baseline_rmse_nm[joint])
    if verdict.causes:
        words += f" → {number(machine, verdict.extended_rmse_nm[joint])}"
    floor = number(machine, verdict.noise_floor_nm[joint])
    return f"{words} {machine.joint(joint).unit('torque')} rms, noise floor {floor}"


def _measured(angle: Axes, torque: Axes, d: Diagnosis, stretch: Stretch, j: int) -> None:
    run = d.validate[stretch.run]
    motion, blocks = run.motion, stretch.within(run.time)
    samples = stretch.within(motion.time)
    style: dict[str, Any] = {"color": "black", "lw": 0.8, "zorder": 3}
    angle.plot(motion.time[samples], motion.q[samples, j], label="measured", **style)
    torque.plot(run.time[blocks], run.measured[blocks, j], **style)


def _angles(
    angles: list[Axes],
    errors: list[Axes],
    validated: ValidationResult,
    d: Diagnosis,
    stretch: Stretch,
    name: str,
    colour: str,
) -> None:
    simulated = simulated_error(validated, d, stretch)
    motion = d.validate[stretch.run].motion
    places = d.baseline.machine.measured_indices
    for j, angle, error in zip(places, angles, errors, strict=True):
        if simulated is None:
            angle.plot([], [], color=colour, lw=2, label=f"{name} (cannot be simulated)")
            continue
        time, drift = simulated
        # The error is recorded less simulated angle, so their difference is the simulated one.
        recorded = np.interp(time, motion.time, motion.q[:, j])
        angle.plot(time, recorded - drift[:, j], color=colour, lw=2, label=name)
        error.plot(time, 1e3 * drift[:, j], color=colour, lw=1.4)


def _torques(
    torques: list[Axes],
    errors: list[Axes],
    validated: ValidationResult,
    d: Diagnosis,
    stretch: Stretch,
    colour: str,
) -> None:
    run = d.validate[stretch.run]
    blocks = stretch.within(run.time)
    places = d.baseline.machine.measured_indices
    for j, torque, error in zip(places, torques, errors, strict=True):
        known = run.usable[blocks, j]
        # NaN breaks the line near reversals, where no model is fitted.
        residual = np.where(known, validated.residuals[stretch.run][blocks, j], np.nan)
        torque.plot(run.time[blocks], run.measured[blocks, j] - residual, color=colour, lw=2)
        error.plot(run.time[blocks], residual, color=colour, lw=1.1)
