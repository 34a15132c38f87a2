"""The joints of a machine, and how their columns are named: ``<joint>_<quantity>_<unit>``."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from numpy.typing import NDArray

Kind = Literal["revolute", "prismatic"]


@dataclass(frozen=True)
class Quantity:
    """A quantity at a joint: patterns of column name and unit for each kind of joint."""

    revolute: str
    revolute_unit: str
    prismatic: str
    prismatic_unit: str


QUANTITIES: dict[str, Quantity] = {
    "angle": Quantity("{joint}_angle_rad", "rad", "{joint}_position_m", "m"),
    "angle_measured": Quantity(
        "{joint}_angle_measured_rad", "rad", "{joint}_position_measured_m", "m"
    ),
    "reference": Quantity("{joint}_reference_rad", "rad", "{joint}_reference_m", "m"),
    "error": Quantity("{joint}_error_rad", "rad", "{joint}_error_m", "m"),
    "velocity": Quantity("{joint}_velocity_rad_s", "rad/s", "{joint}_velocity_m_s", "m/s"),
    "velocity_measured": Quantity(
        "{joint}_velocity_measured_rad_s", "rad/s", "{joint}_velocity_measured_m_s", "m/s"
    ),
    "acceleration": Quantity(
        "{joint}_acceleration_rad_s2", "rad/s²", "{joint}_acceleration_m_s2", "m/s²"
    ),
    "torque": Quantity("{joint}_torque_nm", "N·m", "{joint}_force_n", "N"),
    "torque_measured": Quantity(
        "{joint}_torque_measured_nm", "N·m", "{joint}_force_measured_n", "N"
    ),
    "predicted": Quantity("{joint}_predicted_nm", "N·m", "{joint}_predicted_n", "N"),
    "residual": Quantity("{joint}_residual_nm", "N·m", "{joint}_residual_n", "N"),
    "network": Quantity("{joint}_network_nm", "N·m", "{joint}_network_n", "N"),
    "rmse_before": Quantity("rmse_before_{joint}_nm", "N·m", "rmse_before_{joint}_n", "N"),
    "rmse_after": Quantity("rmse_after_{joint}_nm", "N·m", "rmse_after_{joint}_n", "N"),
    "current": Quantity("{joint}_current_a", "A", "{joint}_current_a", "A"),
    "temperature": Quantity("{joint}_temperature_c", "°C", "{joint}_temperature_c", "°C"),
}


def the(joint: str) -> str:
    """Return a joint's name for a sentence: ``the hip``, but ``joint2`` and ``q`` as they are."""
    return joint if joint[-1:].isdigit() or len(joint) == 1 else f"the {joint}"


@dataclass(frozen=True)
class Joint:
    """One joint of the machine."""

    name: str
    kind: Kind = "revolute"

    def column(self, quantity: str) -> str:
        """Return a quantity's column: of ``"angle"``, ``hip_angle_rad`` or ``axis_position_m``."""
        pattern = QUANTITIES[quantity]
        chosen = pattern.revolute if self.kind == "revolute" else pattern.prismatic
        return chosen.format(joint=self.name)

    def unit(self, quantity: str) -> str:
        """Return the unit of a quantity at this joint, as printed: ``"rad/s"``."""
        pattern = QUANTITIES[quantity]
        return pattern.revolute_unit if self.kind == "revolute" else pattern.prismatic_unit

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
    return ", ".join(f"{joint.name} ({joint.kind})" for joint in joints)


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
        Joint(joint["name"], joint.get("kind", "revolute")) for joint in metadata["joints"]
    )
