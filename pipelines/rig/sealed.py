"""A sealed file: what a virtual rig hides. Only the rig's own process opens it; nothing of it is
ever recorded.

It lists possibilities, each an effect with a range for every value; the file's seed chooses among
them. So a person who reads the file knows what might be hidden, and still has to find what is.
"""

from pathlib import Path
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from pipelines.model import Term
from pipelines.rig.plant import term_of
from pipelines.settings.base import Settings, load_toml
from pipelines.settings.rig.plant import PlantEffect


class Possibility(Settings):
    """An effect that may be hidden."""

    effect: str = Field(description="Its name.")
    joints: tuple[Literal["hip", "knee"], ...] = Field(
        (), description="Where it may act; none for the whole leg."
    )
    values: dict[str, tuple[float, float]] = Field(description="Range of each of its values.")
    either_sign: bool = Field(False, description="Whether all values may be turned negative.")


class SealedFile(Settings):
    """What might be hidden, and the seed that decides."""

    seed: int = Field(ge=0, description="Chooses the effects, their joints and their values.")
    hidden: int = Field(1, ge=0, description="How many of the possibilities are there.")
    possibility: tuple[Possibility, ...] = Field(min_length=1, description="The possibilities.")

    @model_validator(mode="after")
    def _there_are_enough(self) -> Self:
        if self.hidden > len(self.possibility):
            raise ValueError(
                f"hidden: found {self.hidden}, expected at most the {len(self.possibility)}"
                " possibilities"
            )
        return self


def hidden_effects(path: Path) -> tuple[Term, ...]:
    """Return the effects that a sealed file's seed chooses."""
    file = load_toml(path, SealedFile)
    draw = np.random.default_rng(file.seed)
    chosen = draw.permutation(len(file.possibility))[: file.hidden]
    return tuple(_drawn(file.possibility[i], draw, f"{path}: possibility[{i}]") for i in chosen)


def _drawn(possibility: Possibility, draw: np.random.Generator, source: str) -> Term:
    joint = (
        possibility.joints[draw.integers(len(possibility.joints))] if possibility.joints else None
    )
    sign = draw.choice([-1.0, 1.0]) if possibility.either_sign else 1.0
    values = {
        name: float(sign * draw.uniform(low, high))
        for name, (low, high) in possibility.values.items()
    }
    return term_of(PlantEffect(effect=possibility.effect, joint=joint, values=values), source)
