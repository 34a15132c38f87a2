"""A data contract as code: columns with unit, meaning and type, checked on reading and writing."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pyarrow as pa
from pydantic import ValidationError

from pipelines import __version__
from pipelines.contracts import checks, parquet
from pipelines.contracts.joints import QUANTITIES, Joint, joints_of
from pipelines.contracts.metadata import TableKeys
from pipelines.errors import ContractError
from pipelines.validation.explain import explain
from pipelines.validation.suggestion import closest

# For annotations alone: pandas starts slowly, and Arrow is enough for most commands.
if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Column:
    """One column of a table; with ``per_joint``, one of this quantity for each joint."""

    name: str
    unit: str
    meaning: str
    dtype: pa.DataType = field(default_factory=pa.float64)
    required: bool = True
    nullable: bool = False
    """Whether values may be missing (null or NaN); infinities never may."""
    choices: tuple[str, ...] = ()
    per_joint: bool = False
    turns: bool = False
    """Whether an angle has no limit, because its joint turns without end."""

    @property
    def needs_torque(self) -> bool:
        """Whether it is missing at a joint whose torque was not measured."""
        return self.name in ("torque", "torque_measured", "predicted", "residual")

    def at(self, joint: Joint, is_level: bool) -> "Column":
        """Return this quantity's column at one joint of a machine, with gravity or level."""
        name, unit = joint.column(self.name), joint.unit(self.name)
        # Without gravity most torques do not depend on the turn, and no metadata need allow it.
        turns = joint.turns or is_level
        # A torque that was not measured is missing, and so is all that is compared with it.
        nullable = self.nullable or (self.needs_torque and not joint.is_measured)
        return replace(self, name=name, unit=unit, per_joint=False, turns=turns, nullable=nullable)


def per_joint(
    quantity: str, meaning: str, *, required: bool = True, nullable: bool = False
) -> Column:
    """Return a float column that every joint has; name and unit follow from the joint's kind.

    Parameters
    ----------
    quantity : str
        Key of ``QUANTITIES``, such as ``angle``.
    meaning : str
        For docs and Arrow's metadata.
    required : bool, optional
        Whether a table must have it.
    nullable : bool, optional
        Whether values may be missing.

    Raises
    ------
    ValueError
        The quantity has no unit.
    """
    if quantity not in QUANTITIES:
        raise ValueError(f"{quantity}: has no unit; add it to QUANTITIES of contracts/joints.py")
    return Column(quantity, "", meaning, required=required, nullable=nullable, per_joint=True)


class Rows(Protocol):
    """A checked table whose rows can be read piece by piece, any number of times."""

    @property
    def metadata(self) -> dict[str, Any]: ...  # noqa: D102

    @property
    def path(self) -> Path | None: ...  # noqa: D102

    @property
    def joints(self) -> tuple[Joint, ...]: ...  # noqa: D102

    def pieces(self, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """Yield the rows in their order.

        Parameters
        ----------
        columns : sequence of str, optional
            Names of columns; all by default.

        Yields
        ------
        pyarrow.Table
            The next rows.
        """
        ...


@dataclass(frozen=True)
class Table:
    """A checked table in memory."""

    frame: "pd.DataFrame"
    metadata: dict[str, Any]
    path: Path | None = None

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints of the machine."""
        return joints_of(self.metadata)

    def stacked(self, quantity: str) -> "NDArray[np.float64]":
        """Return a quantity of all joints.

        Parameters
        ----------
        quantity : str
            A key of ``QUANTITIES``, such as ``"angle"``.

        Returns
        -------
        (n_rows, n_joints) array
            In the quantity's SI unit.
        """
        return self.frame[[joint.column(quantity) for joint in self.joints]].to_numpy(dtype=float)

    def pieces(self, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """Yield all rows as one piece."""
        frame = self.frame if columns is None else self.frame[list(columns)]
        yield pa.Table.from_pandas(frame, preserve_index=False).replace_schema_metadata()


@dataclass(frozen=True)
class StoredTable:
    """A table in a file, read and checked piece by piece."""

    contract: "Contract"
    metadata: dict[str, Any]
    path: Path

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints of the machine."""
        return joints_of(self.metadata)

    def pieces(self, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
        """Yield the rows in their order.

        Parameters
        ----------
        columns : sequence of str, optional
            Names of columns; all by default.

        Yields
        ------
        pyarrow.Table
            At most ``parquet.ROWS`` checked rows.

        Raises
        ------
        ContractError
            The rows break the contract.
        """
        return self.contract.conformed(
            parquet.pieces(self.path, columns), self.metadata, str(self.path), columns
        )


Rule = Callable[[pa.Table, Mapping[str, Any], str], None]
"""A further check: rule(table, metadata, source) raises ContractError."""


@dataclass(frozen=True)
class Contract:
    """The columns and metadata that a kind of table must have."""

    name: str
    version: int
    purpose: str
    made_by: str
    """The command that makes such a table."""
    columns: tuple[Column, ...]
    metadata: type[TableKeys] = TableKeys
    time: str | None = None
    """The column that must strictly increase."""
    restarts_with: tuple[str, ...] = ()
    """Columns at whose changes time restarts."""
    is_bounded: bool = True
    """Whether implausible values are refused; false for a simulated loop, which may diverge."""
    rules: tuple[Rule, ...] = ()

    @property
    def label(self) -> str:
        """Name and version as written in a file: ``recording/1``."""
        return f"{self.name}/{self.version}"

    def _columns_for(self, metadata: Mapping[str, Any]) -> tuple[Column, ...]:
        """Return every column by its name in a file, one for each joint."""
        is_level = (metadata.get("geometry") or {}).get("gravity_m_s2") == 0.0
        columns: list[Column] = []
        for column in self.columns:
            if column.per_joint:
                columns += [column.at(joint, is_level) for joint in joints_of(metadata)]
            else:
                columns.append(column)
        return tuple(columns)

    def read(self, path: Path | str) -> Table:
        """Return the table in a file.

        Parameters
        ----------
        path : Path or str
            A Parquet file.

        Returns
        -------
        Table
            All rows, checked.

        Raises
        ------
        ContractError
            The file breaks the contract.
        """
        rows, metadata = self.load(path)
        return Table(rows.to_pandas(), metadata, Path(path))

    def load(self, path: Path | str) -> tuple[pa.Table, dict[str, Any]]:
        """Return the rows and metadata of a file without pandas, which starts slowly.

        Parameters
        ----------
        path : Path or str
            A Parquet file.

        Returns
        -------
        tuple
            Arrow table and metadata, checked.

        Raises
        ------
        ContractError
            The file breaks the contract.
        """
        stored = self.scan(path)
        rows = pa.concat_tables(stored.pieces())
        self._apply_rules(rows, stored.metadata, str(path))
        return rows, stored.metadata

    def scan(self, path: Path | str) -> StoredTable:
        """Return the table in a file; its rows are read and checked when they are used.

        Parameters
        ----------
        path : Path or str
            A Parquet file.

        Raises
        ------
        ContractError
            The metadata break the contract.
        """
        path = Path(path)
        _, metadata = parquet.header(path)
        self._refuse_other_contracts(metadata["contract"], path)
        self._check_metadata(metadata, str(path))
        return StoredTable(self, metadata, path)

    def write(self, path: Path | str, frame: "pd.DataFrame", metadata: Mapping[str, Any]) -> None:
        """Check a table and write it atomically.

        Parameters
        ----------
        path : Path or str
            A name that ends in .parquet.
        frame : DataFrame
            Rows in SI units.
        metadata : mapping
            ``contract`` is added.

        Raises
        ------
        ContractError
            The table breaks the contract, or ``path`` cannot hold it.
        """
        path = Path(path)
        metadata = {**metadata, "contract": self.label}
        # Everything is checked before the file is opened.
        rows = self._conform(self._to_arrow(frame, str(path)), metadata, str(path))
        parquet.save(path, [rows], metadata)

    def write_pieces(
        self, path: Path | str, pieces: Iterable[pa.Table], metadata: Mapping[str, Any]
    ) -> None:
        """Write a table as ``write`` does, but piece by piece, to save memory.

        Parameters
        ----------
        path : Path or str
            A name that ends in .parquet.
        pieces : iterable of pyarrow.Table
            Rows in order.
        metadata : mapping
            ``contract`` is added.

        Raises
        ------
        ContractError
            The table breaks the contract, or ``path`` cannot hold it.
        """
        path = Path(path)
        metadata = {**metadata, "contract": self.label}
        self._check_metadata(metadata, str(path))
        # Rules need all rows at once; no contract that is written in pieces has any.
        parquet.save(path, self.conformed(pieces, metadata, str(path)), metadata)

    def refuse_place(self, path: Path) -> None:
        """Refuse a path where this table cannot be written, before it is computed."""
        parquet.refuse_place(path, self.label)

    def check(
        self, frame: "pd.DataFrame", metadata: Mapping[str, Any], source: str = "table"
    ) -> None:
        """Check a frame and its metadata.

        Parameters
        ----------
        frame : DataFrame
            Rows in SI units.
        metadata : mapping
            ``contract`` is added.
        source : str, optional
            Start of the message.

        Raises
        ------
        ContractError
            The frame breaks the contract.
        """
        self._conform(self._to_arrow(frame, source), {**metadata, "contract": self.label}, source)

    def _refuse_other_contracts(self, label: str, path: Path) -> None:
        name, _, version = label.partition("/")
        if name != self.name:
            raise ContractError(
                f"{path}: holds {label}, expected {self.label}; `{self.made_by}` makes a"
                f" {self.name} file"
            )
        if version != str(self.version):
            raise ContractError(
                f"{path}: holds {label}, but exoid {__version__} knows {self.label}; "
                f"update exoid, or make the file again with `{self.made_by}`"
            )

    def _to_arrow(self, frame: "pd.DataFrame", source: str) -> pa.Table:
        # pandas allows a name twice; as keys of `arrays` one of the two would be lost.
        twice = frame.columns[frame.columns.duplicated()]
        if len(twice):
            raise ContractError(
                f"{source}: column {twice[0]} occurs twice, expected each name once; rename one"
            )
        # Lists and structs need an explicit type, which an empty list does not have.
        nested = {one.name: one.dtype for one in self.columns if pa.types.is_nested(one.dtype)}
        arrays = {}
        for name in frame.columns:
            try:
                arrays[str(name)] = pa.Array.from_pandas(frame[name], type=nested.get(name))
            except (pa.ArrowException, TypeError) as error:
                raise ContractError(
                    f"{source}: column {name}: its values have no common type ({error}); give"
                    " them one"
                ) from error
        return pa.table(arrays)

    def _conform(self, table: pa.Table, metadata: Mapping[str, Any], source: str) -> pa.Table:
        """Return a whole table checked, with the contract's types, units and meanings."""
        self._check_metadata(metadata, source)
        # One piece in, one piece out: an empty table has raised an error.
        (conformed,) = self.conformed([table], metadata, source)
        self._apply_rules(conformed, metadata, source)
        return conformed

    def conformed(
        self,
        pieces: Iterable[pa.Table],
        metadata: Mapping[str, Any],
        source: str,
        named: Sequence[str] | None = None,
    ) -> Iterator[pa.Table]:
        """Yield the pieces of a table checked, with the contract's types, units and meanings.

        Parameters
        ----------
        pieces : iterable of pyarrow.Table
            Rows in order; empty pieces are left out.
        metadata : mapping
            With the joints of the table.
        source : str
            Start of messages.
        named : sequence of str, optional
            Columns to require; the others may then be missing.

        Yields
        ------
        pyarrow.Table
            At least one piece.

        Raises
        ------
        ContractError
            The table breaks the contract, or has no rows.
        """
        # Columns that the contract does not know are kept as they are.
        known = self._columns_for(metadata)
        columns = [c for c in known if named is None or c.name in named]
        rows, last_row = 0, None
        for piece in pieces:
            if not piece.num_rows:
                continue
            for column in columns:
                self._refuse_missing_column(piece, column, source, known)
                piece = self._conform_column(piece, column, source, rows)
            self._check_time(piece, last_row, source, rows)
            yield piece
            # Time must also increase from one piece to the next.
            rows, last_row = rows + piece.num_rows, piece.slice(piece.num_rows - 1)
        if not rows:
            raise ContractError(
                f"{source}: holds no rows, expected at least one; `{self.made_by}` makes it again"
            )

    def _check_time(
        self, piece: pa.Table, last_row: pa.Table | None, source: str, first_row: int
    ) -> None:
        if self.time is None or self.time not in piece.column_names:
            return
        # With the last row of the piece before, which is why the first row number is one less.
        rows = pa.concat_tables([last_row, piece]) if last_row else piece
        where = checks.Place(source, self.time, first_row - (1 if last_row else 0))
        checks.refuse_time_not_increasing(rows, self.time, self.restarts_with, where)

    def _apply_rules(self, table: pa.Table, metadata: Mapping[str, Any], source: str) -> None:
        for rule in self.rules:
            rule(table, metadata, source)

    def _refuse_missing_column(
        self, table: pa.Table, column: Column, source: str, known: Sequence[Column]
    ) -> None:
        if not column.required or column.name in table.column_names:
            return
        known_names = {column.name for column in known}
        # Only a column that the contract does not know can be a misspelt one.
        others = [name for name in table.column_names if name not in known_names]
        near = closest(column.name, others)
        meaning = f"{column.meaning} ({column.unit})" if column.unit else column.meaning
        raise ContractError(
            f"{source}: column {column.name} is missing, expected {meaning}; "
            f"a {self.label} table must have it"
            + (f"; if {near} is meant to be it, rename it" if near else "")
        )

    def _conform_column(
        self, table: pa.Table, column: Column, source: str, first_row: int
    ) -> pa.Table:
        index = table.schema.get_field_index(column.name)
        if index < 0:
            return table
        where = checks.Place(source, column.name, first_row)
        values = checks.convert(table.column(index), column.dtype, where)
        checks.refuse_missing(values, column.nullable, where)
        if column.choices:
            checks.refuse_unknown_values(values, column.choices, where)
        # Only physical quantities have a plausible range: a fitted parameter has its unit in
        # another column.
        if (
            self.is_bounded
            and column.dtype == pa.float64()
            and column.unit
            and column.name != self.time
        ):
            checks.refuse_implausible(values, column.unit, where, turns=column.turns)
        about = {"unit": column.unit, "meaning": column.meaning}
        described = pa.field(column.name, column.dtype, metadata=about)
        return table.set_column(index, described, values)

    def _check_metadata(self, metadata: Mapping[str, Any], source: str) -> None:
        try:
            # As JSON, the form of the file: a strict model would refuse tuples and NumPy's numbers.
            self.metadata.model_validate_json(parquet.to_json(metadata, source))
        except ValidationError as error:
            fault = explain(error, dict(metadata))
            raise ContractError(
                f"{source}: metadata {fault}; correct it in the file's `exoid` entry"
            ) from error
