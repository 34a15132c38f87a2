"""Propose a map for logs, and say what is doubtful about it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import InputError, about
from pipelines.importing.guess.counting import countings
from pipelines.importing.guess.joint_table import write_joint
from pipelines.importing.guess.joints import JointColumns, group_joints, order_is_told
from pipelines.importing.guess.names import meanings
from pipelines.importing.guess.proposal import Proposal
from pipelines.importing.guess.time import TimeGuess, guess_time, write_time
from pipelines.importing.quantities.numbers import numbers, whole_nanoseconds
from pipelines.importing.sources.open import open_source
from pipelines.importing.sources.source import Source
from pipelines.importing.time import clock
from pipelines.importing.time.period import repeats_after
from pipelines.settings.import_map import SourceSettings
from pipelines.settings.units import UNITS

TRAIN = 0.7
"""Share of a run, or of the files, to fit to."""
MOST_NAMES = 20
"""Columns that a refusal names."""
MOTION = ("angle", "reference")
"""What tells how a joint moves."""


def propose(paths: Sequence[Path]) -> Proposal:
    """Return a map for logs of one machine, all with the same columns; the first is looked at.

    Raises
    ------
    InputError
        Where a file cannot be read, or has other columns than the first.
    """
    with about(paths[0]):
        source = open_source(paths[0], SourceSettings())
        columns = source.load(source.names)
        durations = [name for name, values in columns.items() if values.dtype.kind == "m"]
        columns = {name: _numeric(values) for name, values in columns.items()}
        dates = {
            name: stamps
            for name, values in columns.items()
            if (stamps := _dates(values)) is not None
        }
        columns |= dates
        found = meanings(source.names)
        told = dict.fromkeys(durations, "ns") | dict.fromkeys(dates, "iso8601")
        time = guess_time(found, columns, told)
        if time is None:
            back = [
                m.column for m in found if m.quantity == "time" and _goes_back(columns[m.column])
            ]
            if back:
                raise InputError(
                    f"its clock, {back[0]!r}, runs backwards; turn the order of its rows round"
                )
            raise InputError(
                f"none of {_in_short(source.names)} goes forward as a clock does, over ten rows or"
                f" more and at {clock.SLOWEST_HZ:g} to {clock.FASTEST_HZ:g} Hz; write the map by"
                " hand, with time.rate_hz where rows are uniform: docs/import.md tells how"
            )
    for path in paths[1:]:
        _refuse_other_columns(path, source)
    proposal = Proposal()
    proposal.remark(
        f"A map for {', '.join(path.name for path in paths)}, proposed by `exoid import --guess`."
    )
    proposal.remark(
        "What is UNSURE was chosen among several; look at it. FILL IN what no log can tell."
    )
    for note in source.notes:
        proposal.remark(f"Read as {source.format}: {note}.")
    write_time(proposal, time)
    columns[time.column] = time.stamps(columns[time.column])
    run = _longest_run(columns[time.column], time.unit)
    assert run is not None, "a clock goes forward over ten rows or more"
    here = {
        name: values[run.rows]
        for name, values in columns.items()
        if len(values) == len(columns[time.column])
    }
    with about(paths[0]):
        joints = group_joints([m for m in found if m.column in here], here, run.time_s, time.column)
        if not joints:
            raise InputError(
                "no name of a column that changes says angle or position, and no column integrates"
                f" to another among {_in_short(source.names)}; write the map by hand,"
                " docs/import.md tells how"
            )
    single = {
        name: float(v[0]) for name, v in columns.items() if len(v) == 1 and v.dtype.kind in "iuf"
    }
    used = {time.column}
    for number, joint in enumerate(joints):
        used |= set(
            write_joint(proposal, number, joint, here, run.time_s, len(joints) == 1, single)
        )
    _write_geometry(proposal, joints)
    _write_recordings(proposal, paths, [_period(path, time, joints) for path in paths])
    _remark_on_the_rest(proposal, [name for name in source.names if name not in used], columns)
    return proposal


def _refuse_other_columns(path: Path, first: Source) -> None:
    with about(path):
        lacking = set(first.names) - set(open_source(path, SourceSettings()).names)
        if lacking:
            raise InputError(
                f"has no column {', '.join(sorted(lacking))}, which {first} has; guess a map for"
                " each of both kinds"
            )


def _in_short(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(names[:MOST_NAMES]) + more


def _goes_back(values: NDArray) -> bool:
    return values.dtype.kind in "iuf" and clock.runs_backwards(values.astype(float))


def _numeric(values: NDArray) -> NDArray:
    """Return a column as numbers where it holds some, whatever stands between them; infinite ones
    are missing."""
    if values.dtype.kind in "biu":
        return values
    if values.dtype.kind == "m":
        return whole_nanoseconds(values)
    found = numbers(values, "", [])
    finite = np.isfinite(found)
    return np.where(finite, found, np.nan) if finite.any() or values.dtype.kind == "f" else values


def _dates(values: NDArray) -> NDArray | None:
    """Return a column of dates as nanoseconds; None of one that is not so written."""
    if (
        values.dtype.kind in "biuf"
        or not len(values)
        or np.isnan(whole_nanoseconds(values[:1])).any()
    ):
        return None
    stamps = whole_nanoseconds(values)
    return stamps if np.isfinite(stamps).all() else None


def _longest_run(stamps: NDArray, unit: str) -> clock.Run | None:
    """Return the longest run of a clock's stamps (n,); None where no two of them follow each
    other."""
    stamps = clock.whole(stamps) if stamps.dtype.kind in "iu" else stamps
    runs = clock.runs(
        (stamps - clock.first_stamp(stamps)).astype(float) * UNITS[unit].factor, stamps, []
    )
    return max(runs, key=len, default=None)


def _write_geometry(proposal: Proposal, joints: Sequence[JointColumns]) -> None:
    proposal.table("[geometry]", "geometry")
    if all(joint.slides for joint in joints):
        proposal.key("gravity_m_s2", 0.0, "9.81 for an axis that rises, a lift's", sure=False)
    else:
        proposal.key(
            "gravity_m_s2",
            9.81,
            "0 for an axis that lies level, or turns about the vertical",
            sure=False,
        )
    if not order_is_told(joints):
        order = " carries ".join(joint.name for joint in joints)
        proposal.doubt(
            "joint",
            f"the order of their columns: {order}; no name says so. Turn their tables round if not",
        )
    if len(joints) > 1:
        proposal.unknown(
            "thigh_length_m", "axis of the first joint to that of the second", blocks=False
        )


def _period(path: Path, time: TimeGuess, joints: Sequence[JointColumns]) -> float | None:
    """Return the period, s, of the motion that a file holds: as it was asked for, where that was
    logged."""
    names = {
        m.column for joint in joints for quantity, m in joint.columns.items() if quantity in MOTION
    }
    with about(path):
        columns = open_source(path, SourceSettings()).load([time.column, *names])
    moved = {name: _numeric(columns[name]) for name in names}
    logged = columns[time.column]
    stamps = time.stamps(whole_nanoseconds(logged) if time.unit == "iso8601" else _numeric(logged))
    if any(
        values.dtype.kind not in "iuf" or len(values) != len(stamps)
        for values in (stamps, *moved.values())
    ):
        return None
    with about(path):
        run = _longest_run(stamps, time.unit)
    if run is None:
        return None
    here = {name: values[run.rows] for name, values in moved.items()}
    return repeats_after(run.time_s, np.column_stack([_motion(joint, here) for joint in joints]))


def _motion(joint: JointColumns, columns: Mapping[str, NDArray]) -> NDArray:
    """Return how a joint was to move, or did, (n,): as its counter would tell that was never
    full."""
    joint = replace(
        joint, columns={quantity: m for quantity, m in joint.columns.items() if quantity in MOTION}
    )
    quantity = "reference" if "reference" in joint.columns else "angle"
    return countings(joint, columns)[quantity].undone(columns[joint.columns[quantity].column])


def _write_recordings(
    proposal: Proposal, paths: Sequence[Path], periods: Sequence[float | None]
) -> None:
    """Propose what trains and what validates: the end of the only file, or the last third of
    several."""
    if len(paths) == 1:
        for purpose, span in (("train", [0.0, TRAIN]), ("validate", [TRAIN, 1.0])):
            proposal.table("[[recording]]", "recording")
            proposal.key("purpose", purpose)
            proposal.key("span", span, "shares of the run")
            _write_period(proposal, periods[0])
        return
    train = max(1, round(TRAIN * len(paths)))
    alike = len({path.stem for path in paths}) < len(paths)
    for number, path in enumerate(paths):
        proposal.table("[[recording]]", "recording")
        here = "/".join(path.absolute().parts[-2:]) if alike else path.name
        proposal.key("files", here.replace("[", "[[]"))
        proposal.key("name", "{folder}_{file}" if alike else "{file}")
        proposal.key("purpose", "train" if number < min(train, len(paths) - 1) else "validate")
        _write_period(proposal, periods[number])


def _write_period(proposal: Proposal, period_s: float | None) -> None:
    if period_s is None:
        proposal.remark(
            "period_s: no motion repeats here; without periods the noise is a guess, not measured"
        )
    else:
        proposal.key(
            "period_s", period_s, "the motion repeats so: what differs between periods is noise"
        )


def _remark_on_the_rest(
    proposal: Proposal, unused: Sequence[str], columns: Mapping[str, NDArray]
) -> None:
    """Name the columns and constants that are in no table."""
    rest = [f"{name} = {columns[name][0]}" if len(columns[name]) == 1 else name for name in unused]
    if rest:
        proposal.lines.append("")
        proposal.remark(f"Not used: {', '.join(rest)}.")
