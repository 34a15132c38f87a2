"""A map: the meaning of a log's columns, from which ``exoid import`` makes recordings."""

import re
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from pipelines.contracts.joint_units import Drive, Kind
from pipelines.contracts.joints import Joint
from pipelines.errors import SettingsError
from pipelines.settings import transmission
from pipelines.settings.base import Positive, Settings, load_toml, repeated
from pipelines.settings.rig.geometry import GeometrySettings
from pipelines.settings.units import ALIASES, UNITS, Unit, unit_named, units_of
from pipelines.validation.suggestion import closest, similar_file

LARGEST = 1e12
"""Greatest number in a map; a larger one is a typing error."""


Bounded = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Factor = Annotated[float, Field(gt=0.0, le=LARGEST)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


class SourceSettings(Settings):
    """The format of the log; keys that are left out are derived from the file."""

    delimiter: str | None = Field(None, description="The character between fields of a text file.")
    decimal: Literal[".", ","] | None = Field(None, description="Decimal point of a text file.")
    comment: str | None = Field(None, min_length=1, max_length=1, description="Mark of comments.")
    skip_rows: int | None = Field(None, ge=0, description="Lines of a text file before its header.")
    columns: tuple[str, ...] | None = Field(None, description="Columns of a text without a header.")
    encoding: str | None = Field(None, description="Encoding of a text file, such as latin-1.")
    join: tuple[str, ...] | None = Field(
        None,
        min_length=2,
        description='Files of one run, joined by their clocks; "*" stands for its name: "*_q.csv".',
    )
    table: str | None = Field(
        None,
        description="Place of the columns: JSON key, HDF5 group, .mat struct, sheet, ROS topic.",
    )

    @field_validator("delimiter")
    @classmethod
    def _is_one_character(cls, delimiter: str | None) -> str | None:
        if delimiter is not None and (len(delimiter) != 1 or delimiter in '"\r\n\0'):
            raise ValueError(
                f'found {delimiter!r}, expected one character, such as "," or ";"; "\\t" is tabs,'
                ' " " is blanks and tabs'
            )
        return delimiter

    @field_validator("join")
    @classmethod
    def _is_of_runs(cls, join: tuple[str, ...] | None) -> tuple[str, ...] | None:
        stars = {pattern.count("*") for pattern in join or ()}
        if join and (len(set(join)) < len(join) or len(stars) > 1 or max(stars) > 1):
            raise ValueError(
                f'found {", ".join(join)}, expected different names, with one "*" in each or none'
            )
        return join


class TimeSettings(Settings):
    """The clock."""

    column: str | None = Field(None, description="The column with the time stamps.")
    unit: str = Field(
        "s",
        description="Of the stamps, after `scale`: s, ms, us, 100ns, ns, min, h or d, or iso8601"
        " for dates written out.",
    )
    scale: Factor = Field(
        1.0, description="Stamps are multiplied by it first: 0.1 with ms for ticks of 0.1 ms."
    )
    format: str | None = Field(
        None, description='How dates are written, such as "%d/%m/%Y %I:%M:%S.%f %p".'
    )
    plus: str | None = Field(
        None, description="Column that is added: fractions of a second, or the time of a date."
    )
    plus_unit: str = Field(
        "ns", description="Unit of `plus`, if it has numbers; of dates it must be given."
    )
    wraps_at: Positive | None = Field(
        None, description="Reading at which the clock wraps around to 0, such as 4294967296."
    )
    rate_hz: Positive | None = Field(None, description="In place of a column: rows a second.")
    restarts: Literal["longest", "split"] = Field(
        "longest", description="Where the clock starts over: keep the longest run, or split there."
    )
    keep: Literal["all", "new"] = Field(
        "all", description='"new" leaves out rows that only repeat the values before.'
    )

    @model_validator(mode="after")
    def _is_one_clock(self) -> Self:
        if (self.column is None) == (self.rate_hz is None):
            raise ValueError(
                "expected either column or rate_hz (rows a second, where no clock was logged)"
            )
        for unit in (self.unit, self.plus_unit):
            _refuse_other_units(unit, ["time"])
        if self.format is not None and not self.is_written:
            raise ValueError(f'format: needs unit = "iso8601", found {self.unit!r}')
        if self.scale != 1.0 and self.is_written:
            raise ValueError("scale: dates have none; remove it")
        if self.plus is not None and (self.column is None or self.wraps_at is not None):
            raise ValueError("plus: needs column, and no wraps_at; remove one of them")
        return self

    @property
    def is_written(self) -> bool:
        """Whether the stamps are dates or times of day in text."""
        return self.unit == "iso8601"

    @property
    def count_s(self) -> float:
        """Duration of a count of the stamps, s."""
        whole = self.plus is None or self.is_written
        unit = unit_named(self.unit if whole else self.plus_unit)
        assert unit is not None, "the map checks its units"
        return unit.factor * self.scale if whole else unit.factor


class ReadingSettings(Settings):
    """A column, or arithmetic with several, and the meaning of its numbers."""

    column: str | None = Field(None, description="Name of the column.")
    expression: str | None = Field(
        None, description='In place of a column: arithmetic with columns, as "gtau * vir".'
    )
    unit: str = Field(description="Unit of the readings, after `scale`.")
    scale: float = Field(
        1.0, description="Readings are multiplied by it first: 0.1 where a register counts tenths."
    )
    sign: Literal[1, -1] = Field(1, description="-1 where the log counts the other way.")
    zero: Bounded = Field(0.0, description="Reading at the joint's zero.")
    signed_bits: Literal[8, 16, 24, 32] | None = Field(
        None, description="Bits of a signed register that was logged without its sign."
    )
    sign_bit: int | None = Field(
        None, ge=3, le=62, description="Bit that is set below zero, where the rest is a magnitude."
    )
    wraps_at: Factor | None = Field(
        None, description="Raw reading at which a counter wraps around to 0, such as 65536 or 360."
    )
    begins_at: Bounded | None = Field(
        None, description="Approximate raw reading at which each log begins, turns counted."
    )
    range: tuple[float, float] | None = Field(None, description="Lowest and highest raw reading.")
    time: str | None = Field(None, description="Column with this channel's own time stamps.")
    time_unit: str | None = Field(None, description="Their unit, if it is not that of [time].")
    time_scale: Factor | None = Field(None, description="Their scale, if it is not that of [time].")
    time_offset_s: Bounded = Field(
        0.0, description="Added to this clock, if it does not begin with that of [time]."
    )

    @model_validator(mode="after")
    def _is_one_reading(self) -> Self:
        if (self.column is None) == (self.expression is None):
            raise ValueError("expected either column or expression, one of them")
        if not 1.0 / LARGEST <= abs(self.scale) <= LARGEST:
            raise ValueError(
                f"scale: found {self.scale:g}, expected {1.0 / LARGEST:g} to {LARGEST:g} in size"
            )
        if self.range is not None and self.range[0] >= self.range[1]:
            raise ValueError(f"range: found {list(self.range)}, expected the lower limit first")
        if self.sign_bit is not None and self.signed_bits is not None:
            raise ValueError("expected either signed_bits or sign_bit, one of them")
        if self.begins_at is not None and self.wraps_at is None:
            raise ValueError("begins_at: needs wraps_at; set wraps_at, or remove it")
        if self.time_unit is not None:
            _refuse_other_units(self.time_unit, ["time"])
        return self

    def clock(self, of_log: TimeSettings) -> TimeSettings:
        """Return the settings of this channel's own clock; what it does not set, the log's has."""
        own: dict[str, Any] = {"column": self.time, "plus": None}
        if self.time_unit is not None or self.time_scale is not None:
            # Another unit comes with another counter.
            own |= {"unit": self.time_unit or of_log.unit, "scale": self.time_scale or 1.0}
            own |= {"wraps_at": None, "format": None}
        return of_log.model_copy(update=own)

    @property
    def known_unit(self) -> Unit:
        """Its unit, which the map has checked."""
        return UNITS[ALIASES.get(self.unit, self.unit)]


class ForceSettings(ReadingSettings):
    """One axis of a cuff force sensor."""

    at: Literal["thigh_front", "thigh_back", "shank_front", "shank_back"] = Field(
        description="Which cuff."
    )
    axis: Literal["x", "y", "z"] = Field(description="x along the segment, y forward, z lateral.")

    @field_validator("unit")
    @classmethod
    def _is_a_force(cls, unit: str) -> str:
        _refuse_other_units(unit, ["force"])
        return unit

    @property
    def target(self) -> str:
        """The recording's column."""
        return f"{self.at}_force_{self.axis}_n"


class JointReadingSettings(ReadingSettings):
    """A quantity of a joint, measured there or at its motor."""

    gear_ratio: Factor = Field(1.0, description="Turns of the motor for one of the joint.")
    counts_per_turn: Factor | None = Field(None, description="Encoder's counts in a turn.")
    counts_per_m: Factor | None = Field(None, description="Counts in a metre of a linear encoder.")
    lead_m: Factor | None = Field(None, description="Travel for a turn of the screw.")
    torque_constant_nm_a: Factor | None = Field(None, description="Torque of the motor per ampere.")
    force_constant_n_a: Factor | None = Field(None, description="The same of a linear motor.")
    gain_nm_v: Factor | None = Field(None, description="Torque for a voltage.")
    gain_n_v: Factor | None = Field(None, description="Force for a voltage.")
    rated_torque_nm: Factor | None = Field(None, description="Value of 100 % or 1000 permille.")
    rated_force_n: Factor | None = Field(None, description="The same of a linear motor.")

    def gain(self, target: str) -> float:
        """Return the factor from a reading in SI to the quantity at the joint.

        Parameters
        ----------
        target : str
            Dimension of the quantity.
        """
        numbers = {key: getattr(self, key) for key in transmission.KEYS}
        given = {key: value for key, value in numbers.items() if value is not None}
        return transmission.gain(self.known_unit.dimension, target, given, self.gear_ratio)


class JointSettings(Settings):
    """A joint: its name, its kind, and its columns."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")] = Field(
        description="Its name; a leg's are hip and knee, in this order."
    )
    kind: Kind = Field("revolute", description="revolute turns, prismatic slides.")
    drive: Drive = Field(
        "measured",
        description='"none" for a passive joint: its torque is zero, and has no column.'
        ' "unmeasured" for a joint whose torque was not recorded: its motion is a known input.',
    )
    turns: bool = Field(False, description="Whether it turns without end: its angle has no limit.")
    enabled: str | None = Field(None, description="Column that is 0 while the drive is off.")
    angle: JointReadingSettings = Field(description="Measured angle, or position of a slide.")
    torque: JointReadingSettings | None = Field(
        None,
        description="Torque, or force, of the drive at the joint; needed unless drive says so.",
    )
    reference: JointReadingSettings | None = Field(None, description="Commanded angle or position.")
    velocity: JointReadingSettings | None = Field(None, description="The drive's own velocity.")
    current: JointReadingSettings | None = Field(None, description="Motor current.")
    temperature: JointReadingSettings | None = Field(None, description="Of the drive or its motor.")

    @model_validator(mode="after")
    def _torque_is_of_a_drive(self) -> Self:
        if self.drive == "measured" and self.torque is None:
            raise ValueError(
                'torque: missing; add it, or set drive = "none" for a joint without a drive,'
                ' drive = "unmeasured" for one whose torque was not recorded'
            )
        if self.drive != "measured" and self.torque is not None:
            raise ValueError(
                f'torque: found with drive = "{self.drive}", expected none; remove one of them'
            )
        if self.turns and self.kind == "prismatic":
            raise ValueError("turns: found at a prismatic joint, expected a revolute one")
        return self

    @model_validator(mode="after")
    def _units_lead_to_the_joint(self) -> Self:
        for quantity, reading in self.readings():
            target = transmission.dimension_at(self.kind, quantity)
            try:
                _refuse_other_units(reading.unit, transmission.sources(target))
                # For its error alone: a number of the drive train that is missing shows here, not
                # in the import.
                reading.gain(target)
            except ValueError as error:
                raise ValueError(f"{quantity}.unit: {error}") from error
        return self

    def readings(self) -> Iterator[tuple[str, JointReadingSettings]]:
        """Yield the quantities that the log has, and their readings."""
        for quantity in type(self).model_fields:
            reading = getattr(self, quantity)
            if isinstance(reading, JointReadingSettings):
                yield quantity, reading

    @property
    def joint(self) -> Joint:
        """The joint, as in files."""
        return Joint(self.name, self.kind, self.drive, self.turns)


class RecordingSettings(Settings):
    """A recording of each file: all of it, or a span."""

    name: str = Field(
        "{file}_{purpose}", description="Its name, of {file}, {folder} and {purpose}."
    )
    files: str = Field(
        "*", description='Pattern of its files, such as "swing_0[0-2].csv" or "run1/*.csv".'
    )
    purpose: Literal["train", "validate"] = Field(description="To fit to, or to judge the fit.")
    run: Literal["exo_alone", "with_human"] = Field(
        "exo_alone", description="exo_alone is any machine without a wearer."
    )
    span_s: tuple[float, float] | None = Field(None, description="First and last second to take.")
    span: tuple[Fraction, Fraction] | None = Field(None, description="The same, as shares 0 to 1.")
    period_s: Positive | None = Field(None, description="Period of the excitation, if it repeats.")
    subject: str | None = Field(None, description="Wearer of the machine.")
    session: str | None = Field(None, description="Name of its session.")

    @field_validator("name")
    @classmethod
    def _is_a_files_name(cls, name: str) -> str:
        if re.fullmatch(r"""[^\x00-\x1f/\\:*?"<>|]+""", name) is None:
            raise ValueError(
                f"found {name!r}, expected a file's name without its folder, and without control"
                ' characters and / \\ : * ? " < > |; -o names the folder'
            )
        # Words in braces that a recording's name may have.
        placeholders = {"file", "folder", "purpose"}
        unknown = set(re.findall(r"\{(.*?)\}", name)) - placeholders
        if unknown:
            raise ValueError(
                f"found {{{min(unknown)}}} in {name!r}, expected {{file}}, {{folder}} or"
                " {purpose}"
            )
        return name

    @model_validator(mode="after")
    def _is_one_span(self) -> Self:
        if self.span is not None and self.span_s is not None:
            raise ValueError("expected either span (shares) or span_s (seconds), one of them")
        for name in ("span", "span_s"):
            limits = getattr(self, name)
            if limits is not None and limits[0] >= limits[1]:
                raise ValueError(f"{name}: found {list(limits)}, expected its start before its end")
        return self

    def is_of(self, file: Path) -> bool:
        """Return whether a file matches; a pattern with folders matches the end of its path."""
        if "/" in self.files:
            return file.absolute().match(self.files)
        return fnmatch(file.name, self.files)

    def name_of(self, file: Path) -> str:
        """Return the name of the recording of a file."""
        words = {"file": file.stem, "folder": file.absolute().parent.name, "purpose": self.purpose}
        # Not str.format, which raises an error for a single brace in a name.
        return re.sub(r"\{(.*?)\}", lambda match: words[match[1]], self.name)


class ImportMap(Settings):
    """The meaning of a log: clock, joints, forces, geometry and recordings."""

    rig: str | None = Field(None, description="Name of the machine.")
    source: SourceSettings = Field(SourceSettings(), description="How the log is read.")
    time: TimeSettings = Field(description="The clock.")
    joint: tuple[JointSettings, ...] = Field(min_length=1, description="The joints.")
    force: tuple[ForceSettings, ...] = Field((), description="Cuff force sensors.")
    geometry: GeometrySettings = Field(GeometrySettings(), description="Lengths and gravity.")
    recording: tuple[RecordingSettings, ...] = Field(
        # Two stretches, not a random split: samples are correlated with their neighbours. A random
        # split would validate on what was fitted.
        (
            RecordingSettings(purpose="train", span=(0.0, 0.7)),
            RecordingSettings(purpose="validate", span=(0.7, 1.0)),
        ),
        min_length=1,
        description="Recordings of each log.",
    )

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if not any(joint.joint.has_sensor for joint in self.joint):
            raise ValueError(
                "joint: none has a measured torque, expected one at least, as it fixes the scale of"
                " inertia; give one a torque"
            )
        for name in repeated(joint.name for joint in self.joint):
            raise ValueError(f"joint: found {name} twice, expected each name once; rename one")
        for target in repeated(force.target for force in self.force):
            raise ValueError(
                f"force: found {target} twice, expected each axis of a cuff once; remove one"
            )
        if self.source.join is not None and (self.time.column is None or self.time.plus):
            raise ValueError("source.join: needs time.column alone, the clock that each file has")
        owners: dict[str, str] = {}
        for place, reading in self.readings():
            if reading.time is not None and self.time.column is None:
                raise ValueError(
                    f"{place}.time: found {reading.time!r} with time.rate_hz, expected time.column,"
                    " as both clocks must have a common origin; set time.column, or remove it"
                )
            if reading.column is not None:
                # A column that serves twice would count as two independent measurements.
                owner = owners.setdefault(reading.column, place)
                if owner != place:
                    raise ValueError(
                        f"{place}.column: found {reading.column!r}, which is also {owner}"
                    )
        return self

    def readings(self) -> Iterator[tuple[str, ReadingSettings]]:
        """Yield every reading and its place in the map, for messages."""
        for i, joint in enumerate(self.joint):
            for quantity, reading in joint.readings():
                yield f"joint[{i}].{quantity}", reading
        for i, force in enumerate(self.force):
            yield f"force[{i}]", force


def load_map(path: Path) -> ImportMap:
    """Return the map in a file.

    Raises
    ------
    SettingsError
        If there is no such file, or it is no map.
    """
    if not path.exists():
        raise SettingsError(
            f"{path}: no such file; "
            + (similar_file(path) or f"`exoid import FILE... --guess --map {path}` proposes one")
        )
    if not path.is_file():  # it is read again for its hash
        kind = "a folder" if path.is_dir() else "a pipe or a device"
        raise SettingsError(f"{path}: is {kind}, expected the file of a map")
    return load_toml(path, ImportMap)


def _refuse_other_units(name: str, dimensions: list[str]) -> None:
    unit = unit_named(name)
    if unit is None or unit.dimension not in dimensions:
        kind = f", a unit of {unit.dimension}" if unit else ""
        known = units_of(*dimensions)
        near = closest(name, known)
        raise ValueError(
            f"found {name!r}{kind}, expected one of {dimensions[0]}: {', '.join(known)}"
            + (f"; did you mean {near}?" if near else "")
        )
