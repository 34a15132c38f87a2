"""``parameters/1``: a model, one row for each parameter."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from pipelines.contracts.checks import first_true
from pipelines.contracts.metadata import Finite, Geometry, InputKeys, Matrix, TableKeys
from pipelines.contracts.table import Column, Contract
from pipelines.errors import ContractError


class OneRun(InputKeys):
    """A cause's own values in one run; the hash is the recording's."""

    values: dict[str, Finite | None]
    """By the parameters' names; null if the cause does not occur in this run."""


class ParametersKeys(TableKeys):
    """Covariance of the parameters, and the machine that they describe."""

    covariance: Matrix | None = None
    mechanism: str | dict[str, Any] | None = None
    geometry: Geometry | None = None
    method: str | dict[str, Any] | None = None
    each_run: dict[str, list[OneRun]] | None = None
    """Values that differ from run to run, by the cause's label; the rows hold the first run's."""


def _covariance_has_a_row_for_each_parameter(
    table: pa.Table, metadata: Mapping[str, Any], source: str
) -> None:
    covariance = metadata.get("covariance")
    if covariance is None:
        return
    lengths = {len(row) for row in covariance}
    count = table.num_rows
    if len(covariance) != count or lengths != {count}:
        raise ContractError(
            f"{source}: metadata covariance: found {len(covariance)} rows of {sorted(lengths)}"
            f" values, expected {count} x {count}, one for each parameter in row order;"
            " write the whole matrix"
        )


def _errors_are_possible(table: pa.Table, metadata: Mapping[str, Any], source: str) -> None:
    smallest = pc.min(table["std_error"]).as_py()
    # None where no standard error was estimated.
    if smallest is not None and smallest < 0.0:
        row = first_true(pc.less(table["std_error"], 0.0))
        value = table["std_error"][row].as_py()
        raise ContractError(
            f"{source}: column std_error, row {row}: found {value:g}, expected 0 or more;"
            " write null where it is not known"
        )
    covariance = np.array(metadata.get("covariance") or np.zeros((0, 0)), dtype=float)
    # Relative to both standard errors, as parameters of different units differ by orders of
    # magnitude.
    size = np.sqrt(np.abs(np.diag(covariance)))
    asymmetric = np.abs(covariance - covariance.T) > 1e-6 * np.outer(size, size)
    if asymmetric.any() or (np.diag(covariance) < 0.0).any():
        raise ContractError(
            f"{source}: metadata covariance: found variances below 0, or a matrix that is not"
            " symmetric; write the covariance of the rows"
        )


PARAMETERS = Contract(
    name="parameters",
    version=1,
    purpose="a model",
    made_by="exoid identify",
    columns=(
        Column("name", "", "the parameter's name", dtype=pa.string()),
        Column("symbol", "", "its symbol in print", dtype=pa.string()),
        Column("joint", "", "its joint; null where shared", dtype=pa.string(), nullable=True),
        Column(
            "run",
            "",
            "the kind of run it holds for; null where it holds for all",
            dtype=pa.string(),
            nullable=True,
            choices=("exo_alone", "with_human", "human"),
        ),
        Column("value", "", "its estimate, in the row's unit"),
        Column("unit", "", "the unit of value, std_error and the interval", dtype=pa.string()),
        Column("std_error", "", "standard error; null where it was not estimated", nullable=True),
        Column("ci95_low", "", "lower end of the 95 % interval", nullable=True),
        Column("ci95_high", "", "upper end of the 95 % interval", nullable=True),
        Column(
            "step",
            "",
            "the fit it comes from",
            dtype=pa.string(),
            choices=("friction", "inertia", "extension"),
        ),
        Column("effect", "", "rigid_body, friction, or a cause's name", dtype=pa.string()),
        Column(
            "each_run",
            "",
            "whether every run has its own, of which this is the first training run's",
            dtype=pa.bool_(),
            required=False,
        ),
    ),
    metadata=ParametersKeys,
    rules=(_covariance_has_a_row_for_each_parameter, _errors_are_possible),
)
