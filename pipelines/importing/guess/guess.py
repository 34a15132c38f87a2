"""Propose a map for logs, with the reason for each line."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import InputError, about
from pipelines.importing.guess.counting import countings
from pipelines.importing.guess.joint_table import write_joint
from pipelines.importing.guess.joints import (
    TURNING,
    JointColumns,
    group_joints,
    may_be_one,
    moving,
    order_is_known,
)
from pipelines.importing.guess.own_clocks import (
    OwnClock,
    clocks_by_rows,
    own_clocks,
    with_slowest,
)
from pipelines.importing.guess.parts import Join, opened, runs_to_join
from pipelines.importing.guess.proposal import Proposal
from pipelines.importing.guess.time import (
    TimeGuess,
    guess_time,
    runs_of,
    settled,
    write_time,
)
from pipelines.importing.naming.meaning import Meaning, meaning
from pipelines.importing.quantities.numbers import numbers, same_stamps, whole_nanoseconds
from pipelines.importing.sources.source import Columns, Source
from pipelines.importing.time import clock
from pipelines.importing.time.period import repeats_after
from pipelines.settings.units import unit_named
from pipelines.signals.filler import fill_value
from pipelines.signals.held import are_held

TRAIN = 0.7
"""Share of a run, or of the files, to fit to."""
MOTION = ("angle", "reference")
"""Quantities that show the motion of a joint."""


def propose(paths: Sequence[Path]) -> Proposal:
    """Return a map for logs of one machine with the same columns, derived from the first.

    Raises
    ------
    InputError
        If a file cannot be read, has other columns than the first, or has no clock or angle.
    """
    paths, join = runs_to_join(paths)
    with about(paths[0]):
        source = opened(paths[0], join)
        columns, typed = _typed_columns(source)
        names = _meanings(source)
        # A slower channel of a table ends before the others, in rows without a stamp.
        ended = {name: _without_blanks(columns[name]) for name in source.clocks.values()}
        time = guess_time(_clock_first(names, source), columns | ended, typed)
        if time is None:
            raise InputError(_no_clock(names, columns))
    for path in paths[1:]:
        _check_columns(path, source, join)
    # A clock without such a name is no angle, such as enc_ms of an encoder.
    stamps = {time.column, *time.rivals}
    by_rows = clocks_by_rows(time, columns) | dict(source.clocks)
    time, clock_names = with_slowest(time, by_rows, names, columns, typed)
    names = [replace(m, quantity="time", joint="") if m.column in stamps else m for m in names]
    of_clocks = own_clocks(clock_names.values(), time, names, columns, typed)
    own = {name: of_clocks[one] for name, one in clock_names.items() if one in of_clocks}
    own = _onto_one_clock(own, time, columns)
    clocks = own | _into_blank_rows(names, time, columns)
    columns[time.column] = time.stamps(*(columns[name] for name in time.columns))
    # Within one run, because integrals and fits across a restart of the clock mean nothing.
    run = max(runs_of(columns[time.column], time.count_s), key=len)
    rows = len(columns[time.column])
    # Columns of another length are constants, or have a clock of their own.
    of_run = {name: values[run.rows] for name, values in columns.items() if len(values) == rows}
    limits = _without_fill_values(of_run, time.column)
    with about(paths[0]):
        joints = group_joints(
            [m for m in names if m.column in of_run], of_run, run.time_s, time.column
        )
        if not joints:
            raise InputError(
                "no angle column found, by name or as the integral of another column, among"
                f" {_in_short(source.names)}; write the map by hand (docs/import.md)"
            )
    clock_s, time = time.count_s, settled(time, joints, of_run, run.time_s)
    run = replace(run, time_s=run.time_s * (time.count_s / clock_s))
    proposal = Proposal()
    _write_source(proposal, paths, source, join)
    joints, resting = moving(joints, of_run)
    write_time(proposal, time, [name for joint in joints for name in _held(joint, of_run)])
    used = {*time.columns}
    alone = len(joints) == 1
    for number, joint in enumerate(joints):
        used |= set(write_joint(proposal, number, joint, of_run, run.time_s, alone, clocks, limits))
    used |= {clocks[name].column for name in used if name in clocks}
    if resting:
        rests = f"{', '.join(resting)} rest while others move, and are left out"
        proposal.doubt("joint", f"{rests}; with them, name their columns too")
    if one := may_be_one(joints):
        runs = f"{', '.join(one)} may be runs or statistics of one joint"
        proposal.doubt("joint.name", f"{runs}; then leave one, and write a map for each other run")
    if not time.unit_sure and any("velocity" in joint.columns for joint in joints):
        proposal.doubt("joint.velocity.unit", "follows from the unit of time, which is unsure")
    _doubt_scales(proposal, source, used)
    _write_geometry(proposal, joints)
    _write_recordings(proposal, paths, [_period(path, join, time, joints, own) for path in paths])
    _write_unused(proposal, [name for name in source.names if name not in used], columns)
    return proposal


def _write_source(
    proposal: Proposal, paths: Sequence[Path], source: Source, join: Join | None
) -> None:
    """Write what the map is for, and how the logs are read."""
    logs = ", ".join(path.name for path in paths)
    proposal.remark(f"A map for {logs}, proposed by `exoid import --guess`.")
    proposal.remark("Check values that are UNSURE. FILL IN values that no log holds.")
    for note in source.notes:
        proposal.remark(f"Read as {source.format}: {note}.")
    if join is not None:
        proposal.table("[source]", "source")
        proposal.key("join", list(join.patterns), "files of one run; their columns differ")


def _doubt_scales(proposal: Proposal, source: Source, used: Collection[str]) -> None:
    """Doubt the scales of columns of which the file has a factor or an offset."""
    for name, text in source.scaling.items():
        if name in used:
            why = f"the file says {text} of {name!r}; if its values are without it, set scale, zero"
            proposal.doubt("joint", why)


def _held(joint: JointColumns, columns: Mapping[str, NDArray]) -> list[str]:
    """Return the columns of a joint's angle and torque whose values are held between new ones."""
    needed = [
        joint.columns[name] for name in ("angle", joint.drive) if name and name in joint.columns
    ]
    return [m.column for m in needed if are_held(columns[m.column].astype(float))]


def _typed_columns(source: Source) -> tuple[Columns, dict[str, str]]:
    """Return the columns as numbers where possible, and the units of dates and durations."""
    raw = source.load(source.names)
    typed = {name: "ns" for name, values in raw.items() if values.dtype.kind == "m"}
    columns = {name: _numeric(values) for name, values in raw.items()}
    for name, values in columns.items():
        stamps = _dates(values)
        if stamps is not None:
            columns[name], typed[name] = stamps, "iso8601"
    return columns, typed


def _meanings(source: Source) -> list[Meaning]:
    """Return the meanings of the columns' names, and of units and clocks that the file gives."""
    clocks = set(source.clocks.values())
    meanings = []
    for name in source.names:
        unit = source.units.get(name)
        one = meaning(f"{name} [{unit}]" if unit and unit_named(unit) else name)
        one = replace(one, column=name)
        meanings.append(replace(one, quantity="time", joint="") if name in clocks else one)
    return meanings


def _clock_first(names: Sequence[Meaning], source: Source) -> list[Meaning]:
    """Return the meanings, of several clocks only that of the first torque or current."""
    of_drive = [m.column for m in names if m.quantity in TURNING and m.column in source.clocks]
    of_others = [name for name in source.clocks if name not in of_drive]
    if not source.clocks:
        return list(names)
    clock_name = source.clocks[(of_drive or of_others)[0]]
    return [m for m in names if m.column == clock_name]


def _into_blank_rows(
    names: Sequence[Meaning], time: TimeGuess, columns: Columns
) -> dict[str, OwnClock]:
    """Interpolate columns that are blank in the rows of the torque; return their clock."""
    drive = next((m for m in names if m.quantity in TURNING), None)
    if drive is None or columns[drive.column].dtype.kind != "f":
        return {}
    stamps, rows = columns[time.column].astype(float), np.isfinite(columns[drive.column])
    of_log = OwnClock(time.column, time.unit, time.scale)
    blank: dict[str, OwnClock] = {}
    for name in (m.column for m in names if m.quantity in ("velocity", *MOTION)):
        values = columns[name]
        known = np.isfinite(values) if values.dtype.kind == "f" else np.array([])
        if known.shape == rows.shape and known.any() and np.mean(known[rows]) < 0.5:
            inside = np.interp(stamps, stamps[known], values[known], left=np.nan, right=np.nan)
            columns[name], blank[name] = inside, of_log
    return blank


def _without_blanks(values: NDArray) -> NDArray:
    return values[np.isfinite(values)] if values.dtype.kind == "f" else values


def _onto_one_clock(
    clocks: Mapping[str, OwnClock], time: TimeGuess, columns: Columns
) -> dict[str, OwnClock]:
    """Interpolate columns with a clock of their own, and return that clock by column."""
    own: dict[str, OwnClock] = {}
    if columns[time.column].dtype.kind not in "iuf":
        return own
    logged = (columns[name] for name in time.columns)
    # Uniform times of rows have no origin in common with another clock.
    stamps = columns[time.column] if time.rate_hz else time.stamps(*logged)
    for name, of_channel in clocks.items():
        if name not in columns:
            continue
        at, values = columns[of_channel.column], columns[name]
        numeric = {at.dtype.kind, values.dtype.kind} <= set("biuf")
        if not numeric or len(at) != len(values) or same_stamps(at, columns[time.column]):
            continue
        known = np.isfinite(at) & np.isfinite(values)
        if known.any() and np.all(np.diff(at[known]) > 0):
            inside = np.interp(
                stamps.astype(float),
                of_channel.at(at[known], time),
                values[known],
                left=np.nan,
                right=np.nan,
            )
            columns[name], own[name] = inside, of_channel
    return own


def _without_fill_values(columns: Columns, clock_column: str) -> dict[str, list[float]]:
    """Replace values for missing readings by NaN; return the limits of the others by column."""
    limits: dict[str, list[float]] = {}
    for name, values in columns.items():
        if values.dtype.kind not in "iuf" or name == clock_column:
            continue
        while (value := fill_value(columns[name].astype(float))) is not None:
            columns[name] = np.where(columns[name] == value, np.nan, columns[name].astype(float))
            known = columns[name][np.isfinite(columns[name])]
            limits[name] = [float(np.min(known)), float(np.max(known))]
    return limits


def _no_clock(names: Sequence[Meaning], columns: Mapping[str, NDArray]) -> str:
    for m in names:
        values = columns[m.column]
        is_clock = m.quantity == "time" and values.dtype.kind in "iuf"
        if is_clock and clock.runs_backwards(values.astype(float)):
            return f"its clock, {m.column!r}, runs backwards; reverse the order of its rows"
    return (
        f"no time column found: none of {_in_short([m.column for m in names])} increases steadily"
        f" for ten rows at {clock.SLOWEST_HZ:g} to {clock.FASTEST_HZ:g} Hz. Write the map by hand,"
        " with time.rate_hz where rows are uniform (docs/import.md)"
    )


def _check_columns(path: Path, first: Source, join: Join | None) -> None:
    with about(path):
        missing = set(first.names) - set(opened(path, join).names)
        if missing:
            raise InputError(
                f"has no column {', '.join(sorted(missing))}, which {first} has; guess its own map"
            )


def _in_short(names: Sequence[str]) -> str:
    # Greatest number of columns in a message.
    most_names = 20
    more = f" and {len(names) - most_names} more" if len(names) > most_names else ""
    return ", ".join(names[:most_names]) + more


def _numeric(values: NDArray) -> NDArray:
    """Return a column as numbers where it has some, NaN for others and for infinite ones."""
    if values.dtype.kind in "biu":
        return values
    if values.dtype.kind == "m":
        return whole_nanoseconds(values)
    converted = numbers(values)
    finite = np.isfinite(converted)
    if finite.any() or values.dtype.kind == "f":
        return np.where(finite, converted, np.nan)
    return values


def _dates(values: NDArray) -> NDArray | None:
    """Return a column of dates as nanoseconds; None where it has other values."""
    if values.dtype.kind in "biuf" or not len(values):
        return None
    # The first value alone shows text that is no date, without parsing a long column.
    if np.isnan(whole_nanoseconds(values[:1])).any():
        return None
    # Text further down is no date, such as a last line that says the log ends.
    return whole_nanoseconds(values)


def _write_geometry(proposal: Proposal, joints: Sequence[JointColumns]) -> None:
    proposal.table("[geometry]", "geometry")
    if all(joint.slides for joint in joints):
        proposal.key("gravity_m_s2", 0.0, "9.81 for a vertical axis, as of a lift", sure=False)
    else:
        why = "0 for a level axis, or a joint that turns about the vertical"
        proposal.key("gravity_m_s2", 9.81, why, sure=False)
    if not order_is_known(joints):
        order = " carries ".join(joint.name for joint in joints)
        proposal.doubt("joint", f"order of the columns: {order}; exchange their tables if not")
    if len(joints) > 1:
        # It blocks nothing: without it, later stages take the length of exoid.toml.
        proposal.unknown(
            "thigh_length_m", "axis of the first joint to that of the second", blocks=False
        )


def _period(
    path: Path,
    join: Join | None,
    time: TimeGuess,
    joints: Sequence[JointColumns],
    clocks: Mapping[str, OwnClock],
) -> float | None:
    """Return the period of the motion in a file, s; of its set-points where these were logged."""
    names = {
        m.column for joint in joints for quantity, m in joint.columns.items() if quantity in MOTION
    }
    with about(path):
        source = opened(path, join)
        own = {name: clocks[name] for name in names if name in clocks}
        columns = source.load([*time.columns, *names, *(one.column for one in own.values())])
    for one in own.values():
        dates = _dates(columns[one.column])
        columns[one.column] = _numeric(columns[one.column]) if dates is None else dates
    if time.unit == "iso8601":
        columns[time.column] = whole_nanoseconds(columns[time.column])
    _onto_one_clock(own, time, columns)
    motion = {name: _numeric(columns[name]) for name in names}
    logged = (columns[name] for name in time.columns)
    as_numbers = whole_nanoseconds if time.unit == "iso8601" else _numeric
    stamps = time.stamps(*map(as_numbers, logged))
    for values in (stamps, *motion.values()):
        if values.dtype.kind not in "iuf" or len(values) != len(stamps):
            return None
    with about(path):
        run = max(runs_of(stamps, time.count_s), key=len, default=None)
    if run is None:
        return None
    of_run = {name: values[run.rows] for name, values in motion.items()}
    return repeats_after(run.time_s, np.column_stack([_motion(joint, of_run) for joint in joints]))


def _motion(joint: JointColumns, columns: Mapping[str, NDArray]) -> NDArray:
    """Return the set-points of a joint, (n,), else its angles, without wraparounds."""
    motion = {quantity: m for quantity, m in joint.columns.items() if quantity in MOTION}
    joint = replace(joint, columns=motion)
    # Set-points repeat exactly; angles also have noise and the drive's errors.
    quantity = "reference" if "reference" in joint.columns else "angle"
    return countings(joint, columns)[quantity].undone(columns[joint.columns[quantity].column])


def _write_recordings(
    proposal: Proposal, paths: Sequence[Path], periods: Sequence[float | None]
) -> None:
    """Propose recordings: the end of the only file, or the last of several, validate."""
    if len(paths) == 1:
        for purpose, span in (("train", [0.0, TRAIN]), ("validate", [TRAIN, 1.0])):
            proposal.table("[[recording]]", "recording")
            proposal.key("purpose", purpose)
            proposal.key("span", span, "shares of the run")
            _write_period(proposal, periods[0])
        return
    train = max(1, round(TRAIN * len(paths)))
    same_names = len({path.stem for path in paths}) < len(paths)
    for number, path in enumerate(paths):
        proposal.table("[[recording]]", "recording")
        pattern = "/".join(path.absolute().parts[-2:]) if same_names else path.name
        # `files` is a pattern, in which an open bracket begins a set of letters.
        proposal.key("files", pattern.replace("[", "[[]"))
        proposal.key("name", "{folder}_{file}" if same_names else "{file}")
        # One file at least is left to validate, whatever the share.
        proposal.key("purpose", "train" if number < min(train, len(paths) - 1) else "validate")
        _write_period(proposal, periods[number])


def _write_period(proposal: Proposal, period_s: float | None) -> None:
    if period_s is None:
        proposal.remark("period_s: no motion repeats here, so the noise cannot be measured")
    else:
        why = "of the motion; differences between periods are noise"
        proposal.key("period_s", period_s, why)


def _write_unused(
    proposal: Proposal, unused: Sequence[str], columns: Mapping[str, NDArray]
) -> None:
    """Name the columns and constants that are in no table."""
    rest = [f"{name} = {columns[name][0]}" if len(columns[name]) == 1 else name for name in unused]
    if rest:
        proposal.lines.append("")
        proposal.remark(f"Not used: {', '.join(rest)}.")
