"""``[acquire]`` and ``[[run]]``: how runs are recorded, and which."""

from typing import Literal, Self

from pydantic import Field

from pipelines.settings.base import Positive, Settings


class AcquireSettings(Settings):
    """Settings that all runs share."""

    rig: str = Field("../rigs/default.toml", description="The rig's file, relative to this one.")
    sample_rate_hz: Positive = Field(200.0, description="Cycles a second, each with a sample.")


class RunSettings(Settings):
    """One run on the rig."""

    name: str = Field(pattern="^[a-z0-9][a-z0-9_]*$", description="Name of the run and its files.")
    run: Literal["exo_alone", "with_human"] = Field(description="Without a wearer, or with one.")
    purpose: Literal["train", "validate"] = Field(description="To fit to, or to judge the fit.")
    duration_s: Positive = Field(40.0, description="Length without ramps, best in whole periods.")
    trajectory: str | None = Field(None, description="Its own excitation file; else the design's.")
    seed: int = Field(0, ge=0, description="Seed of a virtual rig's noise.")

    def repeated(self, step: int) -> Self:
        """Return the run ``NAME+STEP``, which repeats it along the motion of a further step."""
        # A virtual rig's noise differs, as it does between any two runs.
        seed = self.seed + 1000 * step
        return self.model_copy(
            update={"name": f"{self.name}+{step}", "trajectory": None, "seed": seed}
        )

    @property
    def step(self) -> int:
        """The step of an investigation that it belongs to; 0 for a run of exoid.toml."""
        return step_of(self.name)


def step_of(name: str) -> int:
    """Return the step of an investigation that a run ``NAME+STEP`` belongs to; 0 for ``NAME``."""
    step = name.partition("+")[2]
    return int(step) if step.isdecimal() else 0
