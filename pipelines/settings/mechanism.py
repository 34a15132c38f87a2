"""``[mechanism]``: the kind of machine, and its geometry where a recording has none."""

from typing import Self

from pydantic import Field, model_validator

from pipelines.contracts.joint_units import Drive, Kind
from pipelines.contracts.joints import HIP_AND_KNEE, Joint, in_words
from pipelines.errors import SettingsError
from pipelines.settings.base import Gravity, Length, Settings, repeated
from pipelines.validation.suggestion import suggestion

USUAL_JOINTS = {"leg": HIP_AND_KNEE, "single": (Joint("joint"),)}
"""Joints of the mechanisms for which they may be left out."""


class JointSettings(Settings):
    """One joint."""

    name: str = Field(pattern="^[a-z][a-z0-9_]*$", description="Columns of files begin with it.")
    kind: Kind = Field("revolute", description='"revolute" or "prismatic".')
    drive: Drive = Field(
        "measured",
        description='"none" for a passive joint; "unmeasured" if its torque was not recorded.',
    )
    turns: bool = Field(False, description="Whether it turns without end.")


class MechanismSettings(Settings):
    """The mechanism, and its geometry where a recording has none."""

    name: str = Field(
        "leg",
        pattern="^[a-z][a-z0-9_]*$",
        description='"leg" (two revolute joints), "single", or a mechanism of your own.',
    )
    joints: tuple[JointSettings, ...] = Field(
        (), description="Name and kind of each joint, from the base on; optional for the usual."
    )
    thigh_length_m: Length = Field(0.38952, description="First axis to second; the paper's leg.")
    gravity_m_s2: Gravity = Field(
        9.8, description="Gravity, the paper's value; 0 for vertical axes and level slides."
    )

    @model_validator(mode="after")
    def _joints_are_given(self) -> Self:
        # Whether the joints fit the mechanism is checked where all are known: mechanics/read.py.
        if not self.joints and self.name not in USUAL_JOINTS:
            raise ValueError(
                f"name: found {self.name!r} without joints, optional only for"
                f" {' and '.join(USUAL_JOINTS)}; add [[mechanism.joints]], or correct the name:"
                f" {suggestion(self.name, list(USUAL_JOINTS))}"
            )
        for name in repeated(joint.name for joint in self.joints):
            raise ValueError(f"joints: found {name} twice, expected each name once; rename one")
        return self

    def refuse_all_but_the_leg(self, command: str) -> None:
        """Refuse other machines in a command for hip and knee alone.

        Raises
        ------
        SettingsError
            Names the mechanism, its joints and the command.
        """
        # Names count too: columns, limits and drives are those of hip and knee.
        if (self.name, self.all_joints) != ("leg", HIP_AND_KNEE):
            raise SettingsError(
                f"mechanism: found {self.name} with {in_words(self.all_joints)}, expected a leg"
                f" with hip and knee for {command}. Use `exoid import` for others"
            )

    @property
    def geometry(self) -> dict[str, float]:
        """The geometry as in a recording's metadata."""
        return {"thigh_length_m": self.thigh_length_m, "gravity_m_s2": self.gravity_m_s2}

    @property
    def all_joints(self) -> tuple[Joint, ...]:
        """The given joints, else the usual ones."""
        return tuple(Joint(**dict(joint)) for joint in self.joints) or USUAL_JOINTS[self.name]

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Kinds of its joints."""
        return tuple(joint.kind for joint in self.all_joints)
