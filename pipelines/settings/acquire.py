"""``[acquire]`` and ``[[run]]``: how runs are recorded, and which."""

from typing import Literal

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
