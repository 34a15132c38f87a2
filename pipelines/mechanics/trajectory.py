"""Read excitations: Fourier coefficients as TOML or in a table's metadata, or samples alone."""

from pathlib import Path
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.contracts.table import Table
from pipelines.contracts.trajectory import TRAJECTORY
from pipelines.errors import ContractError, SettingsError
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.sampled_trajectory import SampledTrajectory
from pipelines.settings.base import Settings, load_toml
from pipelines.validation.suggestion import similar_file

Trajectory = FourierTrajectory | SampledTrajectory
Row = tuple[float, ...]


class CoefficientFile(Settings):
    """An excitation as TOML: rows of ``a`` and ``b`` are hip and knee, columns are harmonics."""

    unit: Literal["deg", "rad"] = Field(description="Unit of a and b.")
    omega_rad_s: float = Field(gt=0.0, description="Angular frequency of the first harmonic.")
    theta0_rad: tuple[float, float] = Field(
        description="Mean angle of hip and knee, in radians whatever the unit."
    )
    a: tuple[Row, Row] = Field(description="Sine coefficients.")
    b: tuple[Row, Row] = Field(description="Cosine coefficients.")

    @model_validator(mode="after")
    def _rows_have_equal_length(self) -> Self:
        lengths = {len(row) for row in (*self.a, *self.b)}
        if len(lengths) > 1 or 0 in lengths:
            counts = ", ".join(
                f"{name}[{joint}] {len(row)}"
                for name in "ab"
                for joint, row in enumerate(getattr(self, name))
            )
            raise ValueError(
                f"found rows of different length or empty ({counts}), expected as many harmonics in"
                " each"
            )
        return self

    @model_validator(mode="after")
    def _radians_are_radians(self) -> Self:
        rows = [(f"{name}[{i}]", row) for name in "ab" for i, row in enumerate(getattr(self, name))]
        for name, row in rows if self.unit == "rad" else ():
            for k, value in enumerate(row):
                if abs(value) > LARGEST_ANGLE_RAD:
                    raise ValueError(
                        f'{name}[{k}]: found {value} with unit = "rad", which looks like degrees;'
                        ' write unit = "deg"'
                    )
        return self


def read_trajectory(path: Path | str) -> Trajectory:
    """Return the excitation in a TOML file of coefficients or in a ``trajectory/1`` table.

    Parameters
    ----------
    path : Path or str
        ``.toml``, or a table.

    Returns
    -------
    Trajectory
        Angles in rad over time in s.
    """
    path = Path(path)
    if path.suffix == ".toml":
        return _from_toml(path)
    return _trajectory_from_table(TRAJECTORY.read(path))


def _from_toml(path: Path) -> FourierTrajectory:
    if not path.exists():
        raise SettingsError(
            f"{path}: no such file;"
            f" {similar_file(path) or 'check the name, or make one with `exoid design`'}"
        )
    file = load_toml(path, CoefficientFile)
    to_rad = np.pi / 180.0 if file.unit == "deg" else 1.0
    return FourierTrajectory(
        # The published a and b are in degrees, but the mean angles are in radians.
        theta0=np.array(file.theta0_rad),
        a=to_rad * np.array(file.a),
        b=to_rad * np.array(file.b),
        omega=file.omega_rad_s,
    )


def _trajectory_from_table(table: Table) -> Trajectory:
    """Return the excitation in a ``trajectory/1`` table.

    Its coefficients are used if it has them, and its samples otherwise. Samples repeat if the
    metadata hold ``omega_rad_s``, and run once if they do not.
    """
    metadata = table.metadata
    if any(metadata.get(key) is None for key in ("omega_rad_s", "theta0_rad", "a", "b")):
        return _sampled(table)
    trajectory = FourierTrajectory(
        theta0=np.array(metadata["theta0_rad"], dtype=float),
        a=np.array(metadata["a"], dtype=float),
        b=np.array(metadata["b"], dtype=float),
        omega=float(metadata["omega_rad_s"]),
        joints=table.joints,
    )
    _refuse_other_motion(table, trajectory)
    return trajectory


def _sampled(table: Table) -> SampledTrajectory:
    time = table.frame["time_s"].to_numpy(float)
    if len(time) < 2:
        raise ContractError(
            f"{table.path}: holds one sample and no coefficients, expected a motion; "
            "give at least two rows, or a, b, theta0_rad and omega_rad_s in the metadata"
        )
    omega = table.metadata.get("omega_rad_s")
    return SampledTrajectory(
        time=time,
        q=table.stacked("angle"),
        dq=table.stacked("velocity"),
        ddq=table.stacked("acceleration"),
        period_s=2.0 * np.pi / omega if omega else None,
        joints=table.joints,
    )


def _refuse_other_motion(table: Table, trajectory: FourierTrajectory) -> None:
    """Refuse a table whose coefficients and samples are different motions."""
    # Greatest difference, rad, between samples and their coefficients that is rounding error.
    rounding_rad = 1e-5
    joints = len(table.joints)
    if trajectory.a.shape[0] != joints or trajectory.theta0.shape != (joints,):
        raise ContractError(
            f"{table.path}: metadata a, b, theta0_rad: found {trajectory.a.shape[0]} rows and"
            f" {trajectory.theta0.size} mean angles, expected one for each of the"
            f" {joints} joints"
        )
    # Only coefficients are used, so that an edit of the samples alone would have no effect.
    stated = trajectory.at(table.frame["time_s"].to_numpy(float))[0]
    angles = table.stacked("angle")
    row, joint = np.unravel_index(np.argmax(np.abs(angles - stated)), angles.shape)
    if abs(angles[row, joint] - stated[row, joint]) > rounding_rad:
        raise ContractError(
            f"{table.path}: column {table.joints[joint].column('angle')}, row {row}: found"
            f" {angles[row, joint]:.6g}, but the metadata's coefficients give"
            f" {stated[row, joint]:.6g}; drop a and b, or compute the rows from them"
        )
