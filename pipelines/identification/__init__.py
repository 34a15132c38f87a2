"""Identification: friction from the empty exoskeleton, then inertia with the human."""

from pipelines.identification.extension import Extension
from pipelines.identification.two_step import Identified, identify

__all__ = ["Extension", "Identified", "identify"]
