"""Typed models of the ``exoid`` metadata that several tables share; unknown keys are kept."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from pipelines.contracts.joint_units import Drive, Kind

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Matrix = list[list[Finite]]


class Keys(BaseModel):
    """A metadata object: known keys are checked strictly, unknown keys are kept."""

    model_config = ConfigDict(extra="allow", strict=True, frozen=True)


class JointKeys(Keys):
    """One entry of ``joints``."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    kind: Kind = "revolute"
    drive: Drive = "measured"
    turns: bool = False


class InputKeys(Keys):
    """One entry of ``inputs``: a file that this one was computed from."""

    name: str
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class TableKeys(Keys):
    """Metadata of any table."""

    contract: str
    joints: Annotated[list[JointKeys], Field(min_length=1)] | None = None
    created_by: str | None = None
    created_at: str | None = None
    software: dict[str, str] | None = None
    inputs: list[InputKeys] | None = None
    config: dict[str, Any] | None = None

    @field_validator("joints")
    @classmethod
    def _names_differ(cls, joints: list[JointKeys] | None) -> list[JointKeys] | None:
        names = [joint.name for joint in joints or []]
        if len(set(names)) < len(names):
            raise ValueError(f"found joints {', '.join(names)}, expected each name once")
        return joints

    @field_validator("created_at")
    @classmethod
    def _is_a_time(cls, text: str | None) -> str | None:
        try:
            datetime.fromisoformat(text or "2000-01-01")
        except ValueError as error:
            raise ValueError(
                f"found {text!r}, expected an ISO 8601 time such as 2025-01-31T12:00:00+00:00"
            ) from error
        return text


class Geometry(Keys):
    """Lengths of the leg and gravity, each optional; a recording's override exoid.toml's."""

    thigh_length_m: Positive | None = None
    gravity_m_s2: NotNegative | None = None
    thigh_cuff_distance_m: Positive | None = None
    shank_cuff_distance_m: Positive | None = None


class Controller(Keys):
    """The drive's loop at one joint."""

    type: str
    kp_nm_rad: Finite | None = None
    kd_nm_s_rad: Finite | None = None
    rate_hz: Positive | None = None
    limit_nm: Positive | None = None


class Clock(Keys):
    """Offset and rate of a drive's clock against the first drive's."""

    offset_s: Finite
    rate_ppm: Finite
    offset_error_s: NotNegative | None = None
    rate_error_ppm: NotNegative | None = None
    corrected: bool


class Latency(Keys):
    """How long the drives and sensors took to answer a cycle, on the host's clock."""

    cycles: Annotated[int, Field(gt=0)]
    median_ms: NotNegative
    p99_ms: NotNegative
    longest_ms: NotNegative
    left_out: Annotated[int, Field(ge=0)] = 0


class RunKeys(TableKeys):
    """Metadata of a run."""

    run: Literal["exo_alone", "with_human"]
    purpose: Literal["train", "validate"]
    sample_rate_hz: Positive
    period_s: Positive | None = None
    # Numbers of the harmonics of 1/period_s that the motion excites, where detection lines are left
    # empty: all are odd, and every other harmonic is a detection line.
    excited_lines: list[Annotated[int, Field(gt=0)]] | None = None
    rig: str | None = None
    subject: str | None = None
    session: str | None = None
    trajectory: str | None = None
    # First missing time, s, and number of missing samples of each gap.
    gaps: list[tuple[Finite, Annotated[int, Field(gt=0)]]] | None = None
    abort: str | None = None
    recovered: bool | None = None
    clocks: dict[str, Clock] | None = None
    latency: Latency | None = None
    controller: dict[str, Controller] | None = None
    geometry: Geometry | None = None

    @field_validator("excited_lines")
    @classmethod
    def _lines_are_odd(cls, lines: list[int] | None) -> list[int] | None:
        # With an even line, an odd distortion has even lines too, and would be called even.
        if lines is not None and (not lines or any(line % 2 == 0 for line in lines)):
            raise ValueError(
                f"found {lines}, expected odd numbers, or no key where the motion has no detection"
                " lines"
            )
        return lines
