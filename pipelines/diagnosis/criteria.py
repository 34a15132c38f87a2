"""Every number that decides, with its meaning. They are learned: `make learn` writes them.

A share is of the joint's rms torque; a log odds is a natural logarithm.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Criteria:
    """The hyper-parameters of the posterior over sets of causes and laws."""

    drive_weight: float = 2.03
    """How much of a drive row's likelihood counts where nothing is missing; above one, the noise was told too large."""
    cuff_weight: float = 0.019
    """The same of a cuff row."""
    model_error: float = 0.00715
    """What counts as noise besides, per unit of what all causes and laws explain at an output: no form is exact."""
    form_misfit: float = 0.1
    """Share of a residual's rms that counts as noise: no form of any cause follows it exactly."""
    background_law: float = 0.00014
    """Share by which each smooth law is off on a good rig."""
    background_cause: float = 0.00197
    """Share of each cause of the catalogue on a good rig."""
    background_cuff: float = 0.00214
    """Share by which each smooth law of the cuffs' own is off on a good rig."""
    background_wander: float = 0.00219
    """Share by which a good rig's torque wanders in each run."""
    background_line: float = 0.00258
    """Share of a line over the angle or over time on a good rig."""
    amplitudes: tuple[float, float, float] = (0.0919, 0.131, 0.245)
    """Shares that a cause or a law may have, equally likely: prior standard deviations."""
    misfits: tuple[float, float, float] = (0.0, 0.00475, 0.258)
    """Shares of a cause's own size by which its true form may differ from ours, equally likely."""
    shape_sd: float = 0.3
    """Prior standard deviation of a shape about its best value, in its unit of change."""
    cause: float = -2.32
    """Prior log odds of a cause against none."""
    law: float = -2.74
    """Prior log odds of an unlisted law against none."""
    further: float = -1.34
    """Prior log odds of each element beyond the first."""
    other_shape: float = -5.02
    """Log odds of a shape that is not the one which explains most."""
    searched: float = -0.4
    """Log odds per log number of the values among which a wave, a tone or an onset was sought."""
    each_run: float = -2.19
    """Log odds of a cause whose value is another in every run."""
    worn: float = -2.93
    """Log odds of a mass that the person carries, against the machine."""
    impacts: float = 0.0952
    """Share of the bursts' log likelihood that counts for backlash."""
    lines: float = 0.0294
    """Share of a line's log likelihood ratio that counts for a ripple or a tone."""
    coherence: float = 0.264
    """Share of the cuffs' and drive's common scatter that counts for a voluntary torque."""


CRITERIA = Criteria()
