"""Filter a recording for regression, and summarize the result."""

from pipelines.filtering.summary import Summary
from pipelines.mechanics.kinematics import filtered

__all__ = ["Summary", "filtered"]
