"""What is asked of the diagnosis, and what an examination measured."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

from tests.campaigns.blind.scoring import SILENT, Score
from tests.campaigns.blind.statistics import Rate, brier, calibration_error

LARGE = 0.12
"""Magnitude above which nearly everything has to be found."""


@dataclass(frozen=True)
class Measure:
    """One number, and between what it should be."""

    name: str
    shown: str
    value: float | None
    """Shares as shares of one; None where no case says anything."""
    low: float | None = None
    high: float | None = None
    percent: bool = True

    @property
    def target(self) -> str:
        """What is asked for, in words; empty where nothing is."""
        low, high = (
            None if v is None else f"{100 * v if self.percent else v:g}"
            for v in (self.low, self.high)
        )
        unit = " %" if self.percent else ""
        if low and high:
            return f"{low} to {high}{unit}"
        return f">= {low}{unit}" if low else f"<= {high}{unit}" if high else ""

    @property
    def met(self) -> bool | None:
        """Is the measured value within its bounds? None where nothing is asked for, or nothing was
        measured."""
        if self.value is None or not self.target:
            return None
        return (self.low is None or self.value >= self.low) and (
            self.high is None or self.value <= self.high
        )


def measures(scores: Sequence[Score]) -> list[Measure]:
    """Return the targets of the diagnosis, and further measures of its reliability."""
    singles, outside = of(scores, "single"), of(scores, "outside")
    forecasts = [f for s in scores for f in s.probabilities]
    physical = [s for s in scores if s.category != "fault"]
    return [
        _rate("single: right cause and joint first", right(singles), low=0.93),
        _worst_world(scores, low=0.93),
        _rate("the same above 12 %", right(s for s in singles if s.magnitude >= LARGE), low=0.98),
        _lowest("the same, the effect that is found least", singles, low=0.80),
        _rate(
            "the same, other form than the catalogue's",
            right(s for s in singles if not s.own_form),
            low=0.93,
        ),
        _rate("silent about what was too small to be seen", (s.unseen for s in singles)),
        _rate("pair: both named", right(of(scores, "pair")), low=0.85),
        _rate(
            "pair: each named or too small to be seen",
            (s.right or s.unseen for s in of(scores, "pair")),
        ),
        _rate("false alarms, nothing hidden", (not s.right for s in of(scores, "none")), high=0.01),
        _rate(
            "false alarms, small imperfections",
            (not s.right for s in of(scores, "imperfect")),
            high=0.03,
        ),
        _rate("of these alarms: what is named is there", map(_is_there, _alarmed(scores))),
        _rate("outside the catalogue: called unlisted", right(outside), low=0.85),
        _rate(
            "outside the catalogue: nothing_missing",
            (s.status == SILENT for s in outside),
            high=0.05,
        ),
        _rate("outside the catalogue: right family of laws", family(outside), low=0.90),
        _rate("outside, kinds never learned from", right(s for s in outside if s.held_back)),
        _rate("data fault named", right(of(scores, "fault"))),
        _rate(
            "refused or crashed", (s.status in ("refused", "crashed") for s in physical), high=0.0
        ),
        _middle("extended RMSE over true noise floor, median", rmse_over_floor(scores), high=1.05),
        _middle(
            "estimated over true noise floor, median",
            [r for s in scores for r in s.floor_over_truth.values()],
        ),
        _number("Brier score", brier(forecasts), high=0.06),
        _number("expected calibration error", calibration_error(forecasts), high=0.03),
        _number("mean log probability of the truth", log_probability(scores)),
        _rate(
            "95 % intervals that hold the truth",
            (c[2] for s in scores for c in s.covered),
            low=0.92,
            high=0.98,
        ),
        _middle("processor seconds a diagnosis, median", [s.seconds for s in scores], high=8.0),
    ]


def world_measures(scores: Sequence[Score]) -> list[Measure]:
    """Return what is shown of each world."""
    forecasts = [f for s in scores for f in s.probabilities]
    return [
        _rate("single: right first", right(of(scores, "single"))),
        _rate("pair: both named", right(of(scores, "pair"))),
        _rate("outside the catalogue", right(of(scores, "outside"))),
        _rate("outside: right family", family(of(scores, "outside"))),
        _rate("false alarms, nothing hidden", (not s.right for s in of(scores, "none"))),
        _rate("false alarms, imperfections", (not s.right for s in of(scores, "imperfect"))),
        _rate("data fault named", right(of(scores, "fault"))),
        _number("Brier score", brier(forecasts)),
        _number("calibration error", calibration_error(forecasts)),
        _number("mean log probability of the truth", log_probability(scores)),
        _rate("intervals that hold the truth", (c[2] for s in scores for c in s.covered)),
    ]


def family(scores: Iterable[Score]) -> list[bool]:
    """Return which findings are of the right family, where verdicts have findings."""
    return [s.family_right for s in scores if s.family_right is not None]


def log_probability(scores: Iterable[Score]) -> float | None:
    """Return the mean log probability of the truth; None where no verdict has it."""
    known = [s.log_probability for s in scores if s.log_probability is not None]
    return sum(known) / len(known) if known else None


def _worst_world(scores: Sequence[Score], low: float) -> Measure:
    name = "single: right first, the worst world"
    singles = of(scores, "single")
    rates = {
        w: Rate.of(right(s for s in singles if s.world == w)) for w in {s.world for s in singles}
    }
    if not rates:
        return Measure(name, "no cases", None, low)
    world = min(rates, key=lambda w: rates[w].value)
    return Measure(name, f"{world}: {rates[world]}", rates[world].value, low)


def _alarmed(scores: Sequence[Score]) -> list[Score]:
    """Return sessions of small imperfections about which a verdict was not silent."""
    return [
        s for s in of(scores, "imperfect") if not s.right and s.status not in ("refused", "crashed")
    ]


def _is_there(score: Score) -> bool:
    """Return whether causes are named, and each is among a session's imperfections."""
    return bool(score.named) and set(score.named) <= set(score.truth)


def of(scores: Iterable[Score], *categories: str) -> list[Score]:
    """Return the cases of some categories."""
    return [s for s in scores if s.category in categories]


def right(scores: Iterable[Score]) -> list[bool]:
    """Return which are right."""
    return [s.right for s in scores]


def rmse_over_floor(scores: Iterable[Score]) -> list[float]:
    """Return the extended model's RMSE over the true noise floor, of each joint where a model could
    reach it."""
    return [r for s in of(scores, "single", "pair", "none") for r in s.rmse_over_floor.values()]


def _rate(
    name: str, outcomes: Iterable[bool], low: float | None = None, high: float | None = None
) -> Measure:
    rate = Rate.of(outcomes)
    return Measure(name, str(rate), rate.value, low, high)


def _lowest(name: str, singles: Sequence[Score], low: float) -> Measure:
    rates = {
        effect: Rate.of(s.right for s in singles if s.truth[0][0] == effect)
        for effect in effects(singles)
    }
    if not rates:
        return Measure(name, "no cases", None, low)
    effect = min(rates, key=lambda e: rates[e].value)
    return Measure(name, f"{effect}: {rates[effect]}", rates[effect].value, low)


def effects(singles: Iterable[Score]) -> list[str]:
    """Return the effects that were hidden alone."""
    return sorted({s.truth[0][0] for s in singles})


def _middle(name: str, values: Sequence[float], high: float | None = None) -> Measure:
    return _number(name, median(values) if values else None, high)


def _number(name: str, value: float | None, high: float | None = None) -> Measure:
    return Measure(
        name, "no cases" if value is None else f"{value:.3f}", value, None, high, percent=False
    )
