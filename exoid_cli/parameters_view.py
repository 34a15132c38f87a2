"""A model's parameters as a table with intervals and units."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

from exoid_cli.console import console

if TYPE_CHECKING:
    from pipelines.contracts import Joint


def said(value: float, joints: "Sequence[Joint]", decimals: int = 4) -> str:
    """Return a number as it is printed for a machine of these joints."""
    from pipelines.contracts import HIP_AND_KNEE

    # So many decimals do for a leg; a servo's inertia would be nought by them.
    return f"{value:.{decimals}f}" if tuple(joints) == HIP_AND_KNEE else f"{value:.5g}"


def show_parameters(
    rows: Sequence[Mapping[Any, Any]],
    joints: "Sequence[Joint]",
    one_step: Sequence[float] | None = None,
) -> None:
    """Print the rows of a parameters/1 table, with the values of a fit in one step where there are
    any."""
    beside = [] if one_step is None else [[said(one, joints)] for one in one_step]
    console.table(
        ("parameter", "value", "95 % interval", "unit", *(["one step"] if beside else []), "step"),
        [
            (
                _named(row),
                said(row["value"], joints),
                _interval(row, joints),
                row["unit"],
                *(beside[k] if beside else []),
                row["step"],
            )
            for k, row in enumerate(rows)
        ],
        numbers="value, one step",
    )


def _interval(row: Mapping[Any, Any], joints: "Sequence[Joint]") -> str:
    ends = [row[key] for key in ("ci95_low", "ci95_high")]
    return " … ".join(said(end, joints) for end in ends) if all(map(isfinite, ends)) else "held"


def _named(row: Mapping[Any, Any]) -> str:
    joint, run = (row[key] if isinstance(row[key], str) else "" for key in ("joint", "run"))
    return " ".join(filter(None, (joint, row["symbol"], run)))
