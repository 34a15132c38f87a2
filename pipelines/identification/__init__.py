"""Identification: friction from the empty exoskeleton, then inertia with the human."""

from pipelines.identification.extension import Extension
from pipelines.identification.two_step import IdentifiedModel, identify

__all__ = ["Extension", "IdentifiedModel", "identify"]
