"""``trajectory/1``: an excitation, sampled, with its Fourier coefficients."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from pipelines.contracts.metadata import Finite, Matrix, Positive, TableKeys
from pipelines.contracts.table import Column, Contract, per_joint


class TrajectoryKeys(TableKeys):
    """Coefficients (joint x harmonic, radians) and how good the excitation is."""

    omega_rad_s: Positive | None = None
    theta0_rad: list[Finite] | None = None
    # q_j = theta0_j + sum over k of a_jk sin(k omega t) + b_jk cos(k omega t), k from 1.
    a: Matrix | None = None
    b: Matrix | None = None
    criterion: str | None = None
    criterion_value: Finite | None = None
    condition: Positive | None = None
    scaled_condition: Positive | None = None
    log_det: Finite | None = None
    crest_factor: Positive | None = None
    # Harmonics left empty, at which noise and distortion are measured; most excitations lack it.
    detection_lines: list[Annotated[int, Field(gt=0)]] | None = None
    seed: int | None = None

    @model_validator(mode="after")
    def _coefficients_fit_together(self) -> Self:
        a, b = self.a, self.b
        if (a is None) != (b is None):
            raise ValueError("coefficients a and b belong together, found only one of them")
        if a is not None and b is not None and [len(row) for row in a] != [len(row) for row in b]:
            raise ValueError(
                "coefficients a and b have different shapes, expected joint x harmonic in both"
            )
        return self


TRAJECTORY = Contract(
    name="trajectory",
    version=1,
    purpose="an excitation",
    made_by="exoid design",
    columns=(
        Column("time_s", "s", "time since the excitation began"),
        per_joint("angle", "joint angle"),
        per_joint("velocity", "joint velocity"),
        per_joint("acceleration", "joint acceleration"),
    ),
    metadata=TrajectoryKeys,
    time="time_s",
)
