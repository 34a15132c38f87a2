"""Rates with their intervals, and whether probabilities mean what they say."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import sqrt

Z95 = 1.959963984540054


@dataclass(frozen=True)
class Rate:
    """``hits`` of ``cases``, with Wilson's 95 % interval (Wilson, 1927, JASA 22)."""

    hits: int
    cases: int

    @classmethod
    def of(cls, outcomes: Iterable[bool]) -> "Rate":
        """Count outcomes."""
        outcomes = list(outcomes)
        return cls(sum(outcomes), len(outcomes))

    @property
    def value(self) -> float | None:
        """The share; None without cases."""
        return self.hits / self.cases if self.cases else None

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval; everything where nothing was counted."""
        if not self.cases:
            return 0.0, 1.0
        n, p, zz = self.cases, self.hits / self.cases, Z95**2
        middle = (p + zz / (2 * n)) / (1 + zz / n)
        half = Z95 / (1 + zz / n) * sqrt(p * (1 - p) / n + zz / (4 * n * n))
        return max(0.0, middle - half), min(1.0, middle + half)

    def __str__(self) -> str:
        """Return for example ``93 % of 28 (77 to 98)``."""
        if self.value is None:
            return "no cases"
        low, high = self.interval
        return f"{100 * self.value:.1f} % of {self.cases} ({100 * low:.0f} to {100 * high:.0f})"


def brier(forecasts: Sequence[tuple[float, bool]]) -> float | None:
    """Mean squared distance of probabilities from what was (Brier, 1950); None without
    forecasts."""
    if not forecasts:
        return None
    return sum((p - happened) ** 2 for p, happened in forecasts) / len(forecasts)


@dataclass(frozen=True)
class Bin:
    """Forecasts between two probabilities."""

    low: float
    high: float
    mean: float
    happened: Rate


def reliability(forecasts: Sequence[tuple[float, bool]], bins: int = 10) -> list[Bin]:
    """Return the reliability curve; bins without forecasts are left out."""
    curve = []
    for i in range(bins):
        low, high = i / bins, (i + 1) / bins
        inside = [(p, o) for p, o in forecasts if low <= p < high or (i == bins - 1 and p == 1.0)]
        if inside:
            mean = sum(p for p, _ in inside) / len(inside)
            curve.append(Bin(low, high, mean, Rate.of(o for _, o in inside)))
    return curve


def calibration_error(forecasts: Sequence[tuple[float, bool]], bins: int = 10) -> float | None:
    """Expected calibration error: mean distance of the curve from the diagonal, weighed by its
    forecasts."""
    if not forecasts:
        return None
    curve = reliability(forecasts, bins)
    return sum(
        b.happened.cases * abs(b.mean - b.happened.hits / b.happened.cases) for b in curve
    ) / len(forecasts)
