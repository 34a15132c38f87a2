"""``[safety]`` of a rig file: conditions that stop a run, and how it is stopped."""

from typing import Self

from pydantic import Field, model_validator

from pipelines.settings.base import NotNegative, Positive, Settings
from pipelines.settings.rig.with_human import check_tighter, limits_in_force

LONGEST_RAMP_S = 60.0
"""Longest ramp from rest into a motion, s."""


class HumanSafetySettings(Settings):
    """Limits that stop a run with a wearer; others are as without."""

    cuff_force_n: Positive | None = Field(None, description="Highest force on a cuff's axis.")
    following_error_rad: Positive | None = Field(None, description="Largest error of the angle.")


class SafetySettings(Settings):
    """Conditions that stop a run, and how it is stopped."""

    angle_margin_rad: NotNegative = Field(0.02, description="Set-points' least distance to limits.")
    cuff_force_n: Positive = Field(400.0, description="Highest force on a cuff's axis.")
    following_error_rad: Positive = Field(0.15, description="Largest error of the angle.")
    watchdog_s: Positive = Field(0.1, description="Longest wait for a device's next sample.")
    reply_s: Positive | None = Field(None, description="Wait in motion; else 0.3 of watchdog_s.")
    heartbeat_s: Positive | None = Field(None, description="Time-out that is set in the drives.")
    connect_s: Positive = Field(5.0, description="Longest wait for a line or reply before motion.")
    control_s: Positive = Field(1.0, description="Longest time a control word may take.")
    deceleration_rad_s2: float = Field(8.0, gt=0.0, le=100.0, description="Deceleration of a stop.")
    ramp_s: float = Field(3.0, gt=0.0, le=LONGEST_RAMP_S, description="Shortest way in, and back.")
    settle_s: NotNegative = Field(1.0, description="Motion before the recording begins.")
    with_human: HumanSafetySettings = Field(HumanSafetySettings(), description="Limits with_human.")

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        check_tighter(self, self.with_human, "cuff_force_n", "following_error_rad")
        if self.longest_reply_s >= self.watchdog_s:
            raise ValueError(
                f"reply_s: found {self.reply_s:g}, expected less than watchdog_s"
                f" ({self.watchdog_s:g}), or one lost reply stops the run; leave it out"
            )
        return self

    @property
    def longest_reply_s(self) -> float:
        """Longest wait for one reply while the leg moves, s."""
        # Not a third: three lost replies are tolerated. The fourth then stops the run, before the
        # watchdog does, and names the device that is silent.
        return 0.3 * self.watchdog_s if self.reply_s is None else self.reply_s

    def in_force(self, run: str) -> Self:
        """Return the limits in force in a run (``exo_alone`` or ``with_human``)."""
        return self.model_copy(update=limits_in_force(self.with_human, run))
