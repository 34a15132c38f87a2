"""Draw the torque's spectrum: excited lines, detection lines, noise, and the prediction."""

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipelines.contracts.verdict import DetectionLines, Verdict
from pipelines.diagnosis.diagnosis import Diagnosis
from pipelines.diagnosis.evidence.detection_lines import CLASSES, LineSpectrum
from pipelines.diagnosis.verdict.figures.shared import heading
from pipelines.plotting.style import GREY, NOISE

COLOURS = {"excited": GREY, "odd": "#ea580c", "even": "#1d4ed8"}
"""Colours of the classes of lines."""
WORDS = {
    "excited": "excited lines",
    "odd": "empty odd lines: odd distortion",
    "even": "even lines: even distortion",
}


def figure(d: Diagnosis, verdict: Verdict) -> Figure:
    """Draw a panel for each joint with detection lines."""
    joints = verdict.detection_lines
    drawn, axes = plt.subplots(
        len(joints), 1, figsize=(9, 3.1 * len(joints) + 0.9), squeeze=False, sharex=True
    )
    for axis, (joint, lines) in zip(axes[:, 0], joints.items(), strict=True):
        spectrum = d.line_spectrum(joint)
        assert spectrum is not None, "a joint of the verdict has detection lines"
        _draw(axis, spectrum)
        axis.set_ylabel(f"{joint}, {verdict.units[joint]['torque']} rms of a line")
        axis.set_title(_result(lines), fontsize=8.5, loc="left")
    axes[-1, 0].set_xlabel("frequency, Hz (all samples, those at reversals too)")
    handles, words = axes[0, 0].get_legend_handles_labels()
    drawn.legend(handles, words, loc="lower left", ncols=3, fontsize=8.5)
    heading(drawn, "Torque at the lines that the motion excites, and at those that it leaves empty")
    drawn.tight_layout(rect=(0, 0.5 / drawn.get_figheight(), 1, 1))
    return drawn


def _draw(axis: Axes, spectrum: LineSpectrum) -> None:
    """Draw each line as a stem, what the model predicts as a ring, and the noise as an area."""
    # Higher lines are noise alone in any machine: three times the motion's band shows that.
    excited_hz = spectrum.hz[spectrum.classes == "excited"]
    shown = spectrum.hz <= 3.0 * excited_hz.max()
    hz, noise = spectrum.hz[shown], spectrum.noise_nm[shown]
    bottom = 0.3 * float(np.median(noise))
    # The noise of single lines scatters; the mean of neighbours is its level.
    width = min(9, len(noise))
    level = np.sqrt(
        np.convolve(noise**2, np.ones(width), "same")
        / np.convolve(np.ones(len(noise)), np.ones(width), "same")
    )
    axis.fill_between(hz, bottom, level, color=NOISE, label="noise of the mean", zorder=1)
    for name in CLASSES:
        own = shown & (spectrum.classes == name)
        x, y = spectrum.hz[own], np.maximum(spectrum.measured_nm[own], bottom)
        axis.vlines(x, bottom, y, color=COLOURS[name], lw=1.3, zorder=2)
        axis.plot(x, y, "o", ms=3.5, color=COLOURS[name], label=WORDS[name], zorder=3)
    predicted = np.where(spectrum.predicted_nm > bottom, spectrum.predicted_nm, np.nan)[shown]
    words = "rigid body and friction predict"
    axis.plot(hz, predicted, "o", label=words, zorder=4, mfc="none", mec="black", ms=6.5, mew=0.8)
    axis.set_yscale("log")
    axis.set_ylim(bottom=bottom)
    axis.set_xlim(0.0, float(hz[-1]))


def _result(lines: DetectionLines) -> str:
    """Return the test of the residual in words."""
    p = ", ".join(f"{name} {getattr(lines.p_value, name):.2g}" for name in CLASSES)
    return f"p-value that the residual away from reversals is no more than noise: {p}"
