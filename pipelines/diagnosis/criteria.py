"""The hyper-parameters of the posterior, with their meanings.

`make learn` learns all but those that are ``HELD``; whoever accepts what it finds copies it here.

A share is of the joint's rms torque; a log odds is a natural logarithm.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Criteria:
    """The hyper-parameters of the posterior over sets of causes and laws."""

    drive_weight: float = 1.17
    """How much of a drive row's likelihood counts where nothing is missing; above one where noise
    is overestimated."""
    cuff_weight: float = 0.137
    """The same of a cuff row."""
    model_error: float = 0.0075
    """An output counts with weight / (1 + model error x weight x what all causes and laws explain
    there): no form is exact. Held: the score of learning hardly tells it from twice as much, under
    which second causes are lost."""
    cuff_model_error: float = 0.0138
    """The same of a cuff's output."""
    explained_share: float = 0.3
    """Prior standard deviation of each column's share where all explain an output together."""
    form_misfit: float = 0.1
    """Share of a residual's rms that counts as noise: no form of any cause follows it exactly."""
    background_cause: float = 0.00293
    """Share of each cause of the catalogue on a good rig."""
    background_line: float = 0.006
    """Share of a line over the angle or over time on a good rig."""
    amplitudes: tuple[float, float] = (0.0456, 0.137)
    """Shares that a cause or a law may have, equally likely: prior standard deviations."""
    shape_sd: float = 0.393
    """Prior standard deviation of a shape about its best value, in its unit of change."""
    base_rate: float = -1.39
    """Log odds that anything is missing, over those in the simulated sessions: four in five of
    these lack something, of a lab's one in two is assumed."""
    cause: float = -3.075
    """Prior log odds of a cause against none."""
    law: float = -3.37
    """Prior log odds of an unlisted law against none."""
    further: float = -1.6
    """Prior log odds of each element beyond the first."""
    searched: float = -0.663
    """Log odds per log number of the values among which a wave, a tone, an onset or a step was
    sought."""
    each_run: float = -2.57
    """Log odds of a cause whose value is another in every run."""
    worn: float = -4.84
    """Log odds of a mass that the person carries, against the machine."""
    lines: float = 0.03
    """Share of a line's log likelihood ratio that counts for a ripple or a tone."""
    coherence: float = 0.451
    """Share of the cuffs' and drive's common scatter that counts for a voluntary torque."""
    shape_freedom: float = 3.0
    """Degrees of freedom of the Student prior of a free shape: its tails are heavy, for typical
    ranges are known roughly."""
    likely: float = 0.5
    """Least probability at which a cause, alone or with its ties, is named, and at which a finding
    is reported."""
    tied: float = 0.1
    """Share of the named cause's probability from which another cause is its tie."""
    look_alike: tuple[float, float] = (4.44, 2.42)
    """Intercept and slope of the log odds that a named cause is what it is called, over the
    logarithm of the share of the systematic error that it removes on the validation runs."""
    at_floor: float = 1.03
    """RMSE over noise floor up to which a joint has no systematic error (contracts.md)."""
    predicted_better: float = 1.0
    """Log likelihood of the validation runs that an answer by all runs gains at least: less is not
    worth more than a bare mention (Kass and Raftery, 1995, J. Am. Statist. Assoc. 90(430))."""
    left_of_explained: float = 0.2
    """Largest share of the systematic power that is left at a joint which counts as explained
    (contracts.md)."""


BEFORE_EVIDENCE = ("explained_share", "form_misfit", "shape_freedom")
"""Criteria that act before the evidence of a session is stored."""
HELD = (
    *BEFORE_EVIDENCE,
    "model_error",
    "background_line",
    "each_run",
    "lines",
    "base_rate",
    "likely",
    "tied",
    "look_alike",
    "at_floor",
    "predicted_better",
    "left_of_explained",
)
"""What `make learn` does not learn.

- ``BEFORE_EVIDENCE``: they act before the evidence is stored.
- ``base_rate``: the mixture of the sessions decides it.
- ``model_error``: learning hardly tells it from twice as much, under which a second cause beside a
  large one is lost.
- ``lines``: learning tells no difference over a factor of thirty.
- ``background_line``: good drives ripple by a percent of their torque. Too few sessions have such
  drives; learned alone it called their ripple missing.
- ``each_run``: too few sessions have sensors that are tared anew at each start. It is of sessions
  that had more.
- ``look_alike``: learned from the verdicts of a blind examination, by ``python -m tests.learn
  look-alikes``.
- The others decide what is reported of probabilities and errors, and whether all runs are searched.
"""

LEARNED = """\
They were learned from 335 sessions of seeds from 210000 on. Learned anew from 177
sessions whose evidence was stored by revision 1b85b45 (`python -m tests.learn fit --most 60`), they
gave the truth of these a mean log probability of -1.29 instead of -1.48, and that of 356 others
-1.56 instead of -1.57: they were left as they are. But `cause` is lower by ln(3/2): a cause chooses
among two prior sizes now, and chose among three before. `look_alike` was learned from the 97 causes
that were named in 155 sessions of seeds from 505000 and 508000 on. On these same causes it raises
the mean log probability of the truth from -0.54 to -0.20, and lowers the Brier score from 0.079 to
0.060."""
"""What the criteria were learned from, for docs/criteria.md."""

CRITERIA = Criteria()
