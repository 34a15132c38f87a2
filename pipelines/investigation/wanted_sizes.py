"""Wanted sizes: of each cause the smallest one that an experiment is to show."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.diagnosis.detectability.detectability import (
    at_each_shape,
    of_all_causes,
    usual,
)
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.effects import Effect
from pipelines.errors import InputError
from pipelines.mechanics.machine import Machine
from pipelines.wording.label import cause_at

SETTING = "--sizes"
POWER = 0.9
"""Probability with which a diagnosis names a cause of the smallest size."""


@dataclass(frozen=True)
class WantedSize:
    """A cause, and the size from which an experiment is to show it."""

    effect: Effect
    size: float
    """In the unit of the effect's first parameter."""

    @property
    def label(self) -> str:
        """``effect@joint``."""
        return self.effect.label

    def amount(self, size: float) -> float:
        """Return how far a size is from that without any effect, such as a gain of 1."""
        effect = self.effect
        return abs(size - (0.0 if effect.linear else effect.shape[0].neutral))

    @property
    def less_is_more(self) -> bool:
        """Whether a smaller size is a larger effect, as of a stiffness in series."""
        return not self.effect.linear and self.effect.shape[0].name == "stiffness"

    @property
    def unit(self) -> str:
        """Of the size; empty where it has none."""
        unit = self.effect.parameters[0].unit
        return "" if unit == "1" else unit


@dataclass(frozen=True)
class SmallestSizes:
    """The smallest sizes of causes that some runs show, with a probability of 0.9."""

    wanted: tuple[WantedSize, ...]
    smallest: tuple[float, ...]
    """In the unit of each wanted size; inf where no size shows."""
    growth: tuple[float, ...]
    """Of each, relative to the smallest by noise alone."""

    @classmethod
    def of(cls, wanted: Sequence[WantedSize], problem: DetectionProblem) -> "SmallestSizes":
        """Compute them for planned or recorded runs; most shapes of a cause show at that size."""
        results = {effect.label: own for effect, own in of_all_causes(problem, POWER).items()}
        smallest = [abs(usual(results[one.label]).size) for one in wanted]
        by_noise = cls.by_noise(wanted, problem).smallest
        growth = [
            one.amount(a) / one.amount(b) if isfinite(a) and isfinite(b) else 1.0
            for one, a, b in zip(wanted, smallest, by_noise, strict=True)
        ]
        return cls(tuple(wanted), tuple(smallest), tuple(growth))

    @classmethod
    def by_noise(
        cls,
        wanted: Sequence[WantedSize],
        problem: DetectionProblem,
        growth: Sequence[float] | None = None,
    ) -> "SmallestSizes":
        """Compute them by noise alone, times a growth that is known, hundreds of times faster."""
        growth = growth or [1.0] * len(wanted)
        smallest = []
        for one, factor in zip(wanted, growth, strict=True):
            size = abs(usual(at_each_shape(one.effect, problem, POWER)).size)
            smallest.append(size + (factor - 1.0) * one.amount(size) if isfinite(size) else size)
        return cls(tuple(wanted), tuple(smallest), tuple(growth))

    def shares(self) -> NDArray:
        """Return each wanted size relative to the smallest that shows, (n,); from 1 on it shows."""
        shares = []
        for one, size in zip(self.wanted, self.smallest, strict=True):
            share = one.amount(one.size) / one.amount(size) if isfinite(size) else 0.0
            shares.append(1.0 / share if one.less_is_more and share > 0.0 else share)
        return np.array(shares)

    def as_json(self) -> list[dict[str, Any]]:
        """Return a row for each cause; null where no size shows."""
        return [
            {
                "cause": one.label,
                "unit": one.effect.parameters[0].unit,
                "wanted": one.size,
                "smallest": size if isfinite(size) else None,
                "shows": bool(share >= 1.0),
            }
            for one, size, share in zip(self.wanted, self.smallest, self.shares(), strict=True)
        ]


def wanted_sizes(texts: Sequence[str], machine: Machine) -> list[WantedSize]:
    """Return the causes and sizes that a user names.

    Parameters
    ----------
    texts : sequence of str
        ``effect@joint=size`` each, in the unit of the effect's first parameter.
    machine : Machine
        That has them.

    Raises
    ------
    InputError
        Where one is no such text, twice, or a cause that the machine cannot have.
    """
    wanted = [_wanted(text, machine) for text in texts]
    labels = [one.label for one in wanted]
    if not wanted or len(set(labels)) < len(labels):
        raise InputError(
            f"{SETTING}: found {', '.join(labels) or 'no cause'}, expected each cause once, as"
            " EFFECT@JOINT=SIZE; `exoid effects` lists them with their units"
        )
    return wanted


def _wanted(text: str, machine: Machine) -> WantedSize:
    label, _, number = text.rpartition("=")
    try:
        size = float(number)
    except ValueError:
        size = np.nan
    if not label or not isfinite(size) or size <= 0.0:
        raise InputError(
            f"{SETTING}: found {text}, expected EFFECT@JOINT=SIZE with a size above 0, as in"
            " cogging@knee=0.5"
        )
    return WantedSize(cause_at(label, machine, SETTING), size)
