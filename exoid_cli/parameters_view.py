"""A model's parameters as a table with intervals and units."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.contracts import Joint


def format_value(value: float, joints: "Sequence[Joint]", decimals: int = 4) -> str:
    """Return a number as it is printed for a machine of these joints."""
    from pipelines.contracts import HIP_AND_KNEE

    # Fixed decimals suit a leg; the inertia of a small servo would be printed as zero.
    return f"{value:.{decimals}f}" if tuple(joints) == HIP_AND_KNEE else f"{value:.5g}"


def show_parameters(
    rows: Sequence[Mapping[Any, Any]],
    joints: "Sequence[Joint]",
    one_step: Sequence[float] | None = None,
) -> None:
    """Print the rows of a parameters/1 table, and the values of a one-step fit if given."""
    columns = {
        "parameter": [_name(row) for row in rows],
        "value": [format_value(row["value"], joints) for row in rows],
        "95 % interval": [_interval(row, joints) for row in rows],
        "unit": [row["unit"] for row in rows],
        "one step": [format_value(value, joints) for value in one_step or ()],
        "step": [row["step"] for row in rows],
    }
    if not one_step:
        del columns["one step"]
    cells = zip(*columns.values(), strict=True)
    console.table(tuple(columns), cells, numbers="value, one step")


def _interval(row: Mapping[Any, Any], joints: "Sequence[Joint]") -> str:
    ends = [row[key] for key in ("ci95_low", "ci95_high")]
    if any(end is None or not isfinite(end) for end in ends):
        # Without an interval the value was not estimated.
        return "held"
    return " … ".join(format_value(end, joints) for end in ends)


def _name(row: Mapping[Any, Any]) -> str:
    joint, run = (row[key] if isinstance(row[key], str) else "" for key in ("joint", "run"))
    return " ".join(filter(None, (joint, row["symbol"], run)))
