"""Motions from files: a ``motion/1`` as it is, a ``recording/1`` filtered on the way."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pipelines.contracts import MOTION, RECORDING, contract_of
from pipelines.contracts.provenance import sha256
from pipelines.errors import InputError
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.leg import Geometry
from pipelines.mechanics.motion import Motion, motion_from_table
from pipelines.settings.filter import FilterSettings
from pipelines.settings.mechanism import MechanismSettings


def geometry_from(settings: MechanismSettings) -> Geometry:
    """Return the geometry that exoid.toml gives where a recording is silent."""
    return Geometry(thigh_length_m=settings.thigh_length_m, gravity_m_s2=settings.gravity_m_s2)


def read_motion(path: Path, settings: FilterSettings | None = None, default_geometry: Geometry | None = None) -> Motion:
    """Return the motion in a ``motion/1`` or ``recording/1`` file."""
    if contract_of(path) is RECORDING:
        table = motion_table(RECORDING.read(path), settings or FilterSettings())
    else:
        table = MOTION.read(path)
    return motion_from_table(table, default_geometry)


def read_motions(
    paths: Sequence[Path], settings: FilterSettings | None = None, default_geometry: Geometry | None = None
) -> list[Motion]:
    """Return the motions in several files; the same data twice is refused, whatever the names.

    Files of one name in several folders are told apart by their paths.
    """
    seen: dict[str, Path] = {}
    for path in paths:
        if path.is_file():
            twin = seen.setdefault(sha256(path), path)
            if twin is not path:
                raise InputError(f"{path} holds the same data as {twin}; give each run once")
    motions = [read_motion(path, settings, default_geometry) for path in paths]
    names = [path.name for path in paths]
    return [
        motion if names.count(path.name) == 1 else replace(motion, file=str(path))
        for path, motion in zip(paths, motions, strict=True)
    ]
