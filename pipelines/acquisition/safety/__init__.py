"""Safety: limits, checks of each sample, watchdogs, and the supervisor that decides."""

from pipelines.acquisition.safety.limits import HOLD_SAMPLES

__all__ = ["HOLD_SAMPLES"]
