"""Wanted sizes: of each cause the smallest one that an experiment is to show."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from pipelines.diagnosis.detectability.detectability import at_each_shape, usual
from pipelines.diagnosis.detectability.detection_problem import DetectionProblem
from pipelines.effects import Effect
from pipelines.errors import InputError
from pipelines.mechanics.machine import Machine
from pipelines.model import BASELINE
from pipelines.wording.label import effect_at

SETTING = "--sizes"


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

    @classmethod
    def of(cls, wanted: Sequence[WantedSize], problem: DetectionProblem) -> "SmallestSizes":
        """Compute them for planned or recorded runs; most shapes of a cause show at that size."""
        power = 0.9
        smallest = [abs(usual(at_each_shape(one.effect, problem, power)).size) for one in wanted]
        return cls(tuple(wanted), tuple(smallest))

    def shares(self) -> np.ndarray:
        """Return each wanted size relative to the smallest that shows, (n,); from 1 on it shows."""
        return np.array([one.size for one in self.wanted]) / np.array(self.smallest)

    def as_json(self) -> list[dict[str, Any]]:
        """Return a row for each cause; null where no size shows."""
        return [
            {
                "cause": one.label,
                "unit": one.effect.parameters[0].unit,
                "wanted": one.size,
                "smallest": size if isfinite(size) else None,
                "shows": bool(size <= one.size),
            }
            for one, size in zip(self.wanted, self.smallest, strict=True)
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
    return WantedSize(effect_at(label, machine, lambda e: e.name not in BASELINE, SETTING), size)
