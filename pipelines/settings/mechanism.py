"""``[mechanism]``: which mechanism the machine is, and its geometry where a recording does not say its own."""

from typing import Literal, Self

from pydantic import Field, model_validator

from pipelines.contracts.joints import Kind
from pipelines.errors import SettingsError
from pipelines.settings.base import Settings
from pipelines.settings.bounds import MOST_GRAVITY_M_S2

DEFAULT_NAMES = {"leg": ("hip", "knee"), "single": ("joint",)}


class JointSettings(Settings):
    """One joint."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$", description="As columns of files begin with it.")
    kind: Kind = Field("revolute", description='"revolute" or "prismatic".')


class MechanismSettings(Settings):
    """The mechanism, and its geometry where a recording does not say its own."""

    name: Literal["leg", "single"] = Field(
        "leg", description='"leg": two revolute joints in series, any double pendulum. "single": one joint.'
    )
    joints: tuple[JointSettings, ...] = Field(
        (),
        description="Name and kind of each joint from the base on; without it hip and knee, or one revolute joint.",
    )
    thigh_length_m: float = Field(
        0.38952, gt=0.0, description="First joint's axis to the second's, hip to knee; the paper's leg."
    )
    gravity_m_s2: float = Field(
        9.8,
        ge=0.0,
        le=MOST_GRAVITY_M_S2,
        description="Acceleration of gravity; the paper's value. 0 for joints with vertical axes and for level slides.",
    )

    @model_validator(mode="after")
    def _joints_make_the_mechanism(self) -> Self:
        kinds = [joint.kind for joint in self.joints]
        if self.name == "leg" and kinds not in ([], ["revolute", "revolute"]):
            raise ValueError(f"joints: found {', '.join(kinds)}, expected two revolute ones, which make a leg")
        if self.name == "single" and len(kinds) > 1:
            raise ValueError(f"joints: found {len(kinds)}, expected one")
        if len({joint.name for joint in self.joints}) < len(kinds):
            raise ValueError("joints: found a name twice, expected each once")
        return self

    def refuse_all_but_the_leg(self, command: str) -> None:
        """Refuse what a command that works on hip and knee alone cannot do."""
        names = tuple(joint.name for joint in self.joints) or DEFAULT_NAMES[self.name]
        if names != DEFAULT_NAMES["leg"]:
            raise SettingsError(
                f"mechanism: found {self.name} with {', '.join(names)}, expected a leg with hip and knee: {command} is "
                "for these alone; record other machines with their own tools, and give the recordings to "
                "`exoid identify` and `exoid diagnose`"
            )

    @property
    def geometry(self) -> dict[str, float]:
        """As a recording's metadata have it."""
        return {"thigh_length_m": self.thigh_length_m, "gravity_m_s2": self.gravity_m_s2}

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Of its joints."""
        named = self.joints or tuple(JointSettings(name=name) for name in DEFAULT_NAMES[self.name])
        return tuple(joint.kind for joint in named)
