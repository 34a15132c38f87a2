"""``verdict/1``, the result of ``exoid diagnose`` as JSON, checked key by key."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, model_validator

from pipelines.contracts.fault_kind import FaultKind
from pipelines.errors import ContractError
from pipelines.validation.explain import explain

# Strict, as otherwise `true` and "1" would pass for numbers.
Number = Annotated[FiniteFloat, Field(strict=True)]
ByJoint = dict[str, Number]
Interval = Annotated[list[Number], Field(min_length=2, max_length=2)]
Probability = Annotated[Number, Field(ge=0.0, le=1.0 + 1e-9)]
"""Sums of probabilities exceed one by rounding."""


class _Object(BaseModel):
    model_config = ConfigDict(extra="allow")


class EffectAtJoint(_Object):
    """An effect, and the joint that has it; null for the whole machine."""

    effect: str
    joint: str | None

    @property
    def label(self) -> str:
        """``effect@joint``."""
        return f"{self.effect}@{self.joint}" if self.joint else self.effect


class Parameter(_Object):
    """One number of a cause."""

    name: str
    value: Number
    unit: str
    ci95: Annotated[list[float | None], Field(min_length=2, max_length=2)]
    """Null where there is no interval."""


class Gain(_Object):
    """The error that a cause removes."""

    rmse_reduction_nm: Number
    ci95: Interval
    joint: str


class Tie(EffectAtJoint):
    """A cause that these data cannot separate from a named one."""

    why: str
    how_to_separate: str
    probability: Number | None = None
    per_run: bool = False
    """Whether its values differ from run to run; files of older versions lack it."""


class OneRun(_Object):
    """A cause's own values in one run."""

    file: str
    purpose: str
    values: dict[str, Number | None]
    """By the parameters' names; null if the cause does not occur in this run."""
    ci95: dict[str, Interval | None] = {}
    """Null for values fitted to this run alone; files of older versions lack it."""


class KnownEffect(EffectAtJoint):
    """An effect given as present, which is part of the baseline."""

    parameters: list[Parameter]


class Cause(EffectAtJoint):
    """One named cause."""

    side: str
    probability: Probability
    parameters: list[Parameter]
    gain: Gain
    indistinguishable_from: list[Tie]
    evidence: list[str]
    fitted_on_validate: list[str] = []
    """Names of the parameters that are fitted to each validation run."""
    each_run: list[OneRun] = []
    """Empty if all runs share all values; files of older versions lack it."""

    @property
    def per_run(self) -> bool:
        """Whether its values differ from run to run."""
        return bool(self.each_run)

    @property
    def with_ties(self) -> "list[Cause | Tie]":
        """The cause, and those that these data cannot separate from it."""
        return [self, *self.indistinguishable_from]


class LikelyCause(EffectAtJoint):
    """A listed cause that a finding could be."""

    family: str
    probability: Probability
    words: str
    dropped: bool
    """Whether the searched runs name it, but the validation runs do not support it."""


class Law(_Object):
    """An unlisted law that a finding could be."""

    law: str
    joint: str | None
    """Null if the law belongs to no single joint."""
    probability: Probability
    words: str


class Node(_Object):
    """A level on the way to a finding."""

    level: Literal["missing", "repeats", "joint", "family", "cause"]
    value: bool | str | None
    probability: Probability
    words: str


class Finding(_Object):
    """One thing that is missing, at the deepest level that the data support."""

    level: Literal["repeatability", "joint", "family", "cause"]
    repeats: bool | None
    joint: str | None
    family: str | None
    probability: Probability
    words: str
    causes: list[LikelyCause]
    laws: list[Law]
    path: list[Node] = Field(min_length=1)


class Shares(_Object):
    """Shares of the mean square of one joint's residual, by how it repeats."""

    rms_nm: Number
    noise: Number
    repeats: Number | None
    wanders: Number | None
    between_runs: Number
    unsplit: Number
    with_person_only: Number | None


class LineClasses(_Object):
    """A number for each class of lines."""

    excited: Number
    odd: Number
    even: Number


class DetectionLines(_Object):
    """Noise and distortion of one joint's torque, from the lines that the motion leaves empty."""

    runs: int
    periods: int
    highest_hz: Number
    noise_nm: Number
    measured_nm: LineClasses
    predicted_nm: LineClasses
    residual_nm: LineClasses
    p_value: LineClasses
    extended_residual_nm: LineClasses | None = None
    """With the named causes; None without any."""
    extended_p_value: LineClasses | None = None
    change_nm: Number | None = None
    """None without a run of three periods."""
    change_p_value: Number | None = None


class Posterior(_Object):
    """Probabilities after all sets of causes and unlisted laws were weighed."""

    nothing_missing: Probability
    unlisted: Probability
    causes: dict[str, Probability]
    laws: dict[str, Probability]
    searched_causes: dict[str, Probability] = {}
    validation_log_odds: dict[str, Number] = {}
    systematic_error_removed: dict[str, Probability] = {}


class Loop(_Object):
    """One model under adaptive control."""

    tracking_rmse_rad: ByJoint
    peak_torque_nm: ByJoint


class Control(_Object):
    """The adaptive loop on both models, or the reason why there is none."""

    reason: str | None
    run: str | None = None
    controller: dict[str, Any] | None = None
    without: Loop | None = None
    # The key is a reserved word of Python.
    with_: Loop | None = Field(None, alias="with")


class Dependence(_Object):
    """A variable and the share of the error that it predicts."""

    variable: str
    share_before: Number
    share_after: Number


class Reversal(_Object):
    """Friction of a joint that builds up over a travel where it reverses."""

    joint: str
    travel: Number
    unit: str
    at_once_rmse_nm: Number
    otherwise_rmse_nm: Number
    over_travel_rmse_nm: Number


class Proof(_Object):
    """What mending a fault changes."""

    recorded: Number
    """Share of the variance that rigid body and friction do not predict, as recorded."""
    mended: Number
    agreement: Number
    """Correlation of the mended channel with its prediction."""
    channels: int


class Fault(_Object):
    """Something wrong with a file's data."""

    file: str
    channel: str
    what: str
    kind: FaultKind | None = None
    """Files of older versions lack it and the next two."""
    veto: bool = False
    """Whether it stops the diagnosis, unless its kind is accepted."""
    proof: Proof | None = None
    """The change of the error by mending it; None where samples are left out, or by no model."""


class Residual(_Object):
    """The residual without a known cause."""

    description: str


class Input(_Object):
    """A file that the verdict was computed from."""

    name: str
    sha256: str


class Provenance(_Object):
    """The origin; further keys are kept, but not used."""

    inputs: list[Input] = []
    config: dict[str, Any] = {}
    software: dict[str, str] = {}


class Verdict(_Object):
    """The document (docs/contracts.md)."""

    status: str
    summary: str
    finding: str | None = None
    """The summary without acquisition and noise floor; None if acquisition is at fault."""
    acquisition_at_fault: bool = False
    findings: list[Finding] = []
    """Empty if nothing is missing; files of older versions lack it and the next three."""
    sought_on: Literal["train", "all"] = "train"
    """The runs in which causes were sought; files of older versions lack it."""
    fitted_to: Literal["train", "all"] = "train"
    """The runs to which the models are fitted; files of older versions lack it."""
    router: dict[str, Shares] = {}
    detection_lines: dict[str, DetectionLines] = {}
    """By joint; files of older versions and those of other motions lack it."""
    posterior: Posterior | None = None
    """None if acquisition is at fault."""
    caveats: list[str]
    scoring: dict[str, Any]
    torque_rms_nm: ByJoint | None = None
    """Rms of the measured torque; files of older versions lack it."""
    noise_floor_nm: dict[str, Annotated[Number, Field(gt=0.0)]] = Field(min_length=1)
    baseline_rmse_nm: ByJoint
    extended_rmse_nm: ByJoint
    baseline_rmse_unmasked_nm: ByJoint
    extended_rmse_unmasked_nm: ByJoint
    baseline_simulation_rmse_rad: dict[str, Number | None]
    extended_simulation_rmse_rad: dict[str, Number | None]
    unexplained: dict[str, Number | None]
    control: Control
    error_budget: dict[str, ByJoint]
    depends_on: dict[str, list[Dependence]]
    reversals: list[Reversal] = []
    """Files of older versions lack it."""
    units: dict[str, dict[str, str]]
    known: list[KnownEffect] = []
    """Files of older versions lack it."""
    causes: list[Cause]
    data_faults: list[Fault]
    accepted: list[FaultKind] = []
    """Kinds of faults whose veto the user overruled; files of older versions lack it."""
    residual: Residual | None
    runs: list[str]
    noise_floor_from: str
    provenance: Provenance = Provenance()

    @model_validator(mode="after")
    def _joints_agree(self) -> "Verdict":
        # Every joint has a noise floor, so all other tables must have the same joints.
        joints = set(self.noise_floor_nm)
        for key, of_joints in self._tables():
            if set(of_joints) != joints:
                raise ValueError(
                    f"{key} is of {_listed(of_joints)}, noise_floor_nm of {_listed(joints)}"
                )
        named: dict[str, str | None] = {
            f"causes[{k}].gain.joint": one.gain.joint for k, one in enumerate(self.causes)
        }
        named |= {f"findings[{k}].joint": one.joint for k, one in enumerate(self.findings)}
        named |= {f"detection_lines.{joint}": joint for joint in self.detection_lines}
        for key, joint in named.items():
            if joint is not None and joint not in joints:
                raise ValueError(f"{key} is {joint!r}, no joint of noise_floor_nm")
        return self

    def _tables(self) -> Iterator[tuple[str, Mapping[str, Any]]]:
        for key in (
            "baseline_rmse_nm",
            "extended_rmse_nm",
            "baseline_rmse_unmasked_nm",
            "extended_rmse_unmasked_nm",
            "baseline_simulation_rmse_rad",
            "extended_simulation_rmse_rad",
            "unexplained",
            "error_budget",
            "depends_on",
            "units",
        ):
            yield key, getattr(self, key)
        if self.router:
            yield "router", self.router
        if self.torque_rms_nm is not None:
            yield "torque_rms_nm", self.torque_rms_nm
        for key, loop in (("without", self.control.without), ("with", self.control.with_)):
            if loop:
                yield f"control.{key}.tracking_rmse_rad", loop.tracking_rmse_rad
                yield f"control.{key}.peak_torque_nm", loop.peak_torque_nm


def _listed(joints: Any) -> str:
    return ", ".join(sorted(joints)) or "no joint"


def parsed(path: Path) -> Any:
    """Return the content of a JSON file.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    object
        As `json.loads` returns it.

    Raises
    ------
    ContractError
        Names the place of a fault.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError as error:
        raise ContractError(
            f"{path}: is not text ({error.reason} at byte {error.start}); make it again"
        ) from error
    except json.JSONDecodeError as error:
        raise ContractError(
            f"{path}: is not a whole JSON document (line {error.lineno}, column {error.colno}:"
            f" {error.msg}); make it again"
        ) from error


def check(content: Mapping[str, Any], source: str) -> Verdict:
    """Return a checked verdict.

    Parameters
    ----------
    content : mapping
        Keys of the verdict.
    source : str
        Start of the message.

    Raises
    ------
    ContractError
        Names the first key that is missing or wrong.
    """
    try:
        return Verdict.model_validate(content)
    except ValidationError as error:
        raise ContractError(
            f"{source}: {explain(error, content)} (`exoid diagnose` makes it again)"
        ) from error


def read(path: Path) -> Verdict:
    """Return the checked verdict in a file.

    Parameters
    ----------
    path : Path
        A JSON file.

    Raises
    ------
    ContractError
        The file is damaged, or a key is missing or wrong.
    """
    return check(parsed(path), str(path))
