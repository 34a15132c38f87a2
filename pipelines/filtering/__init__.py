"""Filtering: a recording made fit for regression, and what there is to say about it."""

from pipelines.filtering.summary import Filtered, filter_recording

__all__ = ["Filtered", "filter_recording"]
