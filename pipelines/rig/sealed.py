"""A sealed file: the hidden effects of a virtual rig. Only the rig's own process reads it.

It lists possible effects with a range for every value; the file's seed chooses among them. So a
reader of the file knows the possibilities, but not the choice.
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
    """An effect that may be hidden in the rig."""

    effect: str = Field(description="Its name.")
    joints: tuple[Literal["hip", "knee"], ...] = Field((), description="Joints; none for the leg.")
    values: dict[str, tuple[float, float]] = Field(description="Range of each of its values.")
    either_sign: bool = Field(False, description="Whether all values may be turned negative.")


class SealedFile(Settings):
    """Possible hidden effects, and the seed that chooses among them."""

    seed: int = Field(ge=0, description="Chooses the effects, their joints and their values.")
    hidden: int = Field(1, ge=0, description="Number of possibilities that are present.")
    possibility: tuple[Possibility, ...] = Field(min_length=1, description="The possibilities.")

    @model_validator(mode="after")
    def _check_count(self) -> Self:
        if self.hidden > len(self.possibility):
            raise ValueError(
                f"hidden: found {self.hidden}, expected at most {len(self.possibility)}"
            )
        return self


def hidden_effects(path: Path) -> tuple[Term, ...]:
    """Return the effects that a sealed file's seed chooses."""
    file = load_toml(path, SealedFile)
    rng = np.random.default_rng(file.seed)
    # The order of the draws decides: another order would hide other effects for the same seed.
    chosen = rng.permutation(len(file.possibility))[: file.hidden]
    return tuple(
        _draw_effect(file.possibility[i], rng, f"{path}: possibility[{i}]") for i in chosen
    )


def _draw_effect(possibility: Possibility, rng: np.random.Generator, source: str) -> Term:
    joint = (
        possibility.joints[rng.integers(len(possibility.joints))] if possibility.joints else None
    )
    sign = rng.choice([-1.0, 1.0]) if possibility.either_sign else 1.0
    values = {
        name: float(sign * rng.uniform(low, high))
        for name, (low, high) in possibility.values.items()
    }
    return term_of(PlantEffect(effect=possibility.effect, joint=joint, values=values), source)
