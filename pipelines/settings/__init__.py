"""exoid.toml and rig files as typed, validated settings."""

from pipelines.settings.base import Settings, load_toml
from pipelines.settings.datasets import datasets
from pipelines.settings.experiment import Experiment

__all__ = ["Experiment", "Settings", "datasets", "load_toml"]
