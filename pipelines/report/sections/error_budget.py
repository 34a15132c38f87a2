"""The parts of each joint's error, and its fall once the causes are named."""

from dataclasses import dataclass

import numpy as np

from pipelines.contracts.verdict import Verdict
from pipelines.wording.causes import any_label_in_words, shares_in_words
from pipelines.wording.label import SHARES


@dataclass(frozen=True)
class Segment:
    """A part of a bar, from ``low`` to ``high`` of the bar's quantity."""

    key: str
    label: str
    tone: str
    """Name of its colour."""
    low: float
    high: float
    share: float
    """Its mean square; negative where a cause raises a joint's error."""

    @property
    def rms(self) -> float:
        """Root mean square, with the sign of the share."""
        # Mean squares add up, rms values do not: bars are laid in the former, numbers given in the
        # latter.
        return float(np.copysign(np.sqrt(abs(self.share)), self.share))


@dataclass(frozen=True)
class Bar:
    """One joint's mean square error, its parts laid end to end."""

    joint: str
    unit: str
    segments: tuple[Segment, ...]

    @property
    def total(self) -> float:
        """Mean square of the whole error."""
        return sum(segment.share for segment in self.segments)

    @property
    def rms(self) -> float:
        """Root mean square of the whole error."""
        return float(np.sqrt(self.total))

    @property
    def low(self) -> float:
        """Start of the bar: negative where a cause raises the error."""
        return min(0.0, *(segment.low for segment in self.segments))

    @property
    def high(self) -> float:
        """End of the bar."""
        return max(segment.high for segment in self.segments)


@dataclass(frozen=True)
class Fall:
    """One joint's error without and with the causes, and its noise floor."""

    joint: str
    unit: str
    before: float
    after: float | None
    """None if no cause is named."""
    floor: float
    unexplained: float | None
    """Share of the excess over the floor that remains; None without an excess."""
    torque: float | None = None
    """Rms of the measured torque; None in files of older versions."""

    @property
    def highest(self) -> float:
        """The largest of error before, error after and floor."""
        # The floor, too, because it may lie above every error.
        return max(self.before, self.after or 0.0, self.floor)


def with_causes(verdict: Verdict) -> str:
    """Return the title of the model with the causes."""
    # Of tied causes the model holds the most probable one.
    tied = any(cause.indistinguishable_from for cause in verdict.causes)
    return f"with the {'likeliest' if tied else 'named'} cause{'s' * (len(verdict.causes) > 1)}"


def budget(verdict: Verdict) -> list[Bar]:
    """Return a bar for each joint; causes that raise its error lie left of zero."""
    bars = []
    words_of = shares_in_words(verdict.causes)
    tones = {
        "noise_floor": "noise",
        "repeatable_unexplained": "left",
        "not_repeatable": "wanders",
        "unexplained": "left",
    }
    for joint, shares in verdict.error_budget.items():
        # Two ends grow apart: parts of the error right of zero, causes that raise it left.
        low = high = 0.0
        segments = []
        causes = [key for key in shares if key not in SHARES]
        for key, share in shares.items():
            start = high if share >= 0 else low
            # There are three colours for causes.
            tone = tones[key] if key in tones else f"cause{1 + causes.index(key) % 3}"
            words = SHARES.get(key) or words_of.get(key) or any_label_in_words(key)
            # The verdict counts no more noise than there is error, which may be below the floor.
            if key == "noise_floor" and share < 0.999 * verdict.noise_floor_nm[joint] ** 2:
                words = "noise, all of it below the floor"
            end = start + share
            segments.append(Segment(key, words, tone, min(start, end), max(start, end), share))
            if share >= 0:
                high = end
            else:
                low = end
        bars.append(Bar(joint, torque_unit(verdict, joint), tuple(segments)))
    return bars


def falls(verdict: Verdict) -> list[Fall]:
    """Return each joint's error without and with the causes."""
    results = []
    for joint, before in verdict.baseline_rmse_nm.items():
        after = verdict.extended_rmse_nm[joint] if verdict.causes else None
        floor, unexplained = verdict.noise_floor_nm[joint], verdict.unexplained[joint]
        torque = (verdict.torque_rms_nm or {}).get(joint)
        unit = torque_unit(verdict, joint)
        results.append(Fall(joint, unit, before, after, floor, unexplained, torque))
    return results


def torque_unit(verdict: Verdict, joint: str) -> str:
    """Return the unit of a joint's torque or force."""
    return verdict.units[joint].get("torque", "N·m")
