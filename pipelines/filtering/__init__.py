"""Filtering: a recording made fit for regression, and what there is to say about it."""

from pipelines.filtering.summary import Summary
from pipelines.mechanics.kinematics import filtered

__all__ = ["Summary", "filtered"]
