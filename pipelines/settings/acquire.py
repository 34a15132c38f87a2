"""``[acquire]`` and ``[[run]]``: how runs are recorded, and which."""

from typing import Literal

from pydantic import Field

from pipelines.settings.base import Settings


class AcquireSettings(Settings):
    """Settings that all runs share."""

    rig: str = Field(
        "../rigs/default.toml", description="The rig's description, relative to this file."
    )
    sample_rate_hz: float = Field(
        200.0, gt=0.0, description="Cycles a second, one sample of each drive in each."
    )


class RunSettings(Settings):
    """One run on the rig."""

    name: str = Field(
        pattern=r"^[a-z0-9][a-z0-9_]*$", description="Name of the run and of its files."
    )
    run: Literal["exo_alone", "with_human"] = Field(description="Without a wearer, or with one.")
    purpose: Literal["train", "validate"] = Field(
        description="Fitted, or held back to judge the fit."
    )
    duration_s: float = Field(
        40.0, gt=0.0, description="Length, ramps not counted; whole periods are best."
    )
    trajectory: str | None = Field(
        None,
        description=(
            "An excitation of its own (Parquet or TOML), relative to this file; else the designed"
            " one."
        ),
    )
    seed: int = Field(0, ge=0, description="Seed of a virtual rig's noise.")
