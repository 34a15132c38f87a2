"""The joints of a machine, and how their columns are named: ``<joint>_<quantity>_<unit>``."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pipelines.contracts.joint_units import Drive, Kind, unit_at

if TYPE_CHECKING:
    from numpy.typing import NDArray


QUANTITIES = {
    "angle": "rad",
    "angle_measured": "rad",
    "reference": "rad",
    "error": "rad",
    "velocity": "rad/s",
    "velocity_measured": "rad/s",
    "acceleration": "rad/s²",
    "torque": "N·m",
    "torque_measured": "N·m",
    "predicted": "N·m",
    "residual": "N·m",
    "network": "N·m",
    "rmse_before": "N·m",
    "rmse_after": "N·m",
    "current": "A",
    "temperature": "°C",
}
"""Quantities at a joint, with their units at a revolute one."""


def the(joint: str) -> str:
    """Return a joint's name for a sentence: ``the hip``, but ``joint2`` and ``q`` as they are."""
    return joint if joint[-1:].isdigit() or len(joint) == 1 else f"the {joint}"


@dataclass(frozen=True)
class Joint:
    """One joint of the machine."""

    name: str
    kind: Kind = "revolute"
    drive: Drive = "measured"
    """``none`` for a passive joint, whose torque is zero; ``unmeasured`` where it was not recorded,
    so that only the motion is known."""
    turns: bool = False
    """True for a joint that turns without end."""

    @property
    def metadata(self) -> dict[str, Any]:
        """Its entry of a file's ``joints``, without the usual values."""
        entry: dict[str, Any] = {"name": self.name, "kind": self.kind}
        if self.drive != "measured":
            entry["drive"] = self.drive
        if self.turns:
            entry["turns"] = True
        return entry

    def __str__(self) -> str:
        """Return its name and what it is, for messages."""
        drive = {"none": ", no drive", "unmeasured": ", torque not measured"}.get(self.drive, "")
        endless = ", turns without end" * self.turns
        return f"{self.name} ({self.kind}{drive}{endless})"

    @property
    def is_passive(self) -> bool:
        """Whether it has no drive: its torque is zero, and no measurement."""
        return self.drive == "none"

    @property
    def is_measured(self) -> bool:
        """Whether its torque is known, measured or zero: only then is its equation used."""
        return self.drive != "unmeasured"

    @property
    def has_sensor(self) -> bool:
        """Whether its torque is a reading."""
        return self.drive == "measured"

    def column(self, quantity: str) -> str:
        """Return a quantity's column: of ``"angle"``, ``hip_angle_rad`` or ``axis_position_m``."""
        words = quantity.replace("angle", self.place).replace("torque", self.effort)
        own = f"{words}_{self.name}" if words.startswith("rmse_") else f"{self.name}_{words}"
        # A unit such as rad/s² ends the name as rad_s2.
        letters = str.maketrans({"/": "_", "²": "2", "·": None, "°": None})
        return f"{own}_{self.unit(quantity).lower().translate(letters)}"

    def unit(self, quantity: str) -> str:
        """Return the unit of a quantity at this joint, as printed: ``"rad/s"``."""
        return unit_at(self.kind, QUANTITIES[quantity])

    @property
    def place(self) -> str:
        """The word for the measured quantity of its encoder."""
        return "angle" if self.kind == "revolute" else "position"

    @property
    def effort(self) -> str:
        """The word for the action of its drive."""
        return "torque" if self.kind == "revolute" else "force"


HIP_AND_KNEE = (Joint("hip"), Joint("knee"))


def columns_of(joints: Iterable[Joint], quantities: "Mapping[str, NDArray]") -> dict[str, Any]:
    """Return columns by name, joint by joint, from quantities of all joints, (n, J) each."""
    return {
        joint.column(quantity): values[:, j]
        for j, joint in enumerate(joints)
        for quantity, values in quantities.items()
    }


def in_words(joints: Iterable[Joint]) -> str:
    """Return the joints with their kinds, for messages."""
    return ", ".join(map(str, joints))


def either(words: Iterable[str]) -> str:
    """Join the different words by "or": ``N``, or ``N or N·m`` for a machine of both kinds."""
    return " or ".join(dict.fromkeys(words))


def joints_of(metadata: Mapping[str, Any]) -> tuple[Joint, ...]:
    """Return the joints in a file's metadata.

    Parameters
    ----------
    metadata : mapping
        Metadata of any contract.

    Returns
    -------
    tuple of Joint
        By default hip and knee, both revolute.
    """
    # A leg's files need not list their joints; those of any other machine do.
    if "joints" not in metadata:
        return HIP_AND_KNEE
    return tuple(
        Joint(
            joint["name"],
            joint.get("kind", "revolute"),
            joint.get("drive", "measured"),
            joint.get("turns", False),
        )
        for joint in metadata["joints"]
    )
