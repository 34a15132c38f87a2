"""Make recordings of a log and its map: choose rows, columns and spans."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipelines.contracts import describe, parquet
from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.contracts.provenance import sha256
from pipelines.errors import InputError, SettingsError, about
from pipelines.importing.finding import Finding, Note, counted, noting
from pipelines.importing.log import Log, read_log
from pipelines.importing.quantities import labels
from pipelines.importing.quantities.numbers import TAKEN_FOR_MISSING
from pipelines.importing.sanity import plausibility
from pipelines.importing.sources.joined import open_run, parts_of
from pipelines.importing.time import held
from pipelines.importing.time.clock import FASTEST_HZ, SLOWEST_HZ, Run, Sampling
from pipelines.importing.time.period import better_period, repeats_after
from pipelines.settings.import_map import ImportMap, RecordingSettings

FEWEST = 10
"""Least number of rows of a recording."""

Begins = dict[str, tuple[float, str]]
"""The first reading of each counter, SI, and the log that had it."""


@dataclass(frozen=True)
class ImportedRecording:
    """A recording made of a log, not yet written."""

    name: str
    columns: dict[str, NDArray]
    metadata: dict[str, Any]

    def __len__(self) -> int:
        return len(self.columns["time_s"])

    def pieces(self) -> Iterator[pa.Table]:
        """Yield the rows in their order, some at a time."""
        table = pa.table(self.columns)
        for first in range(0, len(self), parquet.ROWS):
            yield table.slice(first, parquet.ROWS)

    @property
    def file(self) -> str:
        """Name of its file."""
        return f"{self.name}.parquet"


def recordings(
    path: Path, settings: ImportMap, map_path: Path, begins: Begins
) -> Iterator[ImportedRecording]:
    """Yield the recordings that a map makes of a log, and add its counters to ``begins``.

    Raises
    ------
    InputError
        If the log cannot be read, or is too short.
    SettingsError
        If the map has no ``[[recording]]`` for this file, or does not fit the log.
    """
    wanted = [recording for recording in settings.recording if recording.is_of(path)]
    if not wanted:
        patterns = ", ".join(recording.files for recording in settings.recording)
        raise SettingsError(
            f"{map_path}: no [[recording]] matches {path.name}, only {patterns}; add one"
        )
    with about(path):
        own_clocks = [reading.time for _, reading in settings.readings() if reading.time]
        source = open_run(path, settings.source, settings.time.column, own_clocks)
        log = read_log(source, settings, map_path)
        # A bag is a folder; the order makes its list of hashes the same on every system.
        of_bag = sorted(file for file in path.iterdir() if file.is_file()) if path.is_dir() else []
        join = settings.source.join
        files = of_bag or ([path] if join is None else parts_of(path, join))
        provenance = describe(
            inputs=[*files, map_path],
            config=settings.model_dump(mode="json", exclude_none=True),
        )
        of_log = {
            "source": path.name,
            "sha256": [sha256(file) for file in files],
            "format": log.source.format,
            "notes": list(log.source.notes),
            "rows_in_source": log.rows,
            # The paths as they were given, from which a report writes the command that repeats
            # this.
            "given": {"source": path.as_posix(), "map": map_path.as_posix()},
        }
        _check_length(log)
        runs = _chosen(log.runs, settings.time.restarts, log.findings)
        for number, run in enumerate(runs, 1):
            suffix = f"_run{number}" if len(runs) > 1 else ""
            for recording in _recordings_of(run, suffix, log, settings, wanted, begins):
                recording.metadata["imported"] |= of_log
                recording.metadata.update(provenance)
                yield recording


def _check_length(log: Log) -> None:
    if log.rows < FEWEST:
        raise InputError(
            f"found {counted(log.rows, 'row')}, a recording needs at least {FEWEST}; log for longer"
        )
    longest = max(map(len, log.runs), default=0)
    if longest < FEWEST:
        raise InputError(
            f"its clock starts over too often: the longest run has {longest} of {log.rows} rows,"
            f" expected at least {FEWEST}; correct [time] in the map"
        )


def _chosen(runs: Sequence[Run], restarts: str, findings: list[Finding]) -> list[Run]:
    """Return the runs that become recordings."""
    long = [run for run in runs if len(run) >= FEWEST]
    if len(runs) == 1:
        return long
    kept = long if restarts == "split" else [max(long, key=len)]
    rows = ", ".join(f"{run.rows[0]}-{run.rows[-1]}" for run in kept)
    lost = sum(map(len, runs)) - sum(map(len, kept))
    setting = "" if restarts == "split" else " (time.restarts)"
    action = f"rows {rows} kept, {lost} left out{setting}"
    findings.append(Finding("time", f"{len(runs)} runs", action))
    return kept


def _recordings_of(
    run: Run,
    suffix: str,
    log: Log,
    settings: ImportMap,
    wanted: Sequence[RecordingSettings],
    begins: Begins,
) -> Iterator[ImportedRecording]:
    path, findings = log.source.path, [*log.findings, *run.findings]
    columns = log.quantities(run, findings)
    if settings.time.keep == "new":
        run, columns = held.only_new(run, columns, log.required, findings)
    else:
        findings += held.remarks(run, {name: columns[name] for name in log.required})
    whole = _whole_rows(columns, log.required, findings)
    time = run.time_s[whole]
    sampling = Sampling.of(time)
    note = noting("time", findings)
    _note_sampling(sampling, note)
    columns = {"time_s": time} | {name: values[whole] for name, values in columns.items()}
    # The torque of a joint without a drive is known to be zero; one that was not recorded is not.
    columns |= {
        joint.joint.column("torque"): np.full(len(time), 0.0 if joint.joint.is_passive else np.nan)
        for joint in settings.joint
        if not joint.joint.has_sensor
    }
    _check_values(columns, settings)
    _check_periods(wanted, float(run.time_s[-1]))
    _note_period(columns, settings, wanted, note)
    # On the whole run: short spans show less, and each would repeat the remarks.
    findings += plausibility.check(columns, settings)
    findings += labels.check(
        {
            name: values[run.rows][whole]
            for name, values in log.labels.items()
            if len(values) == log.rows
        }
    )
    findings += _turns_apart(f"{path.name}{suffix}", columns, log.turns, begins)
    spans = [_span(time, float(run.time_s[-1]), recording) for recording in wanted]
    _check_overlap(time, wanted, spans)
    findings += _wrong_periods(columns, settings, wanted, spans)
    for recording, rows in zip(wanted, spans, strict=True):
        own = {name: values[rows] for name, values in columns.items()}
        # Rate and gaps of the span itself, as a logger's rate may change during a run.
        cut = Sampling.of(own["time_s"])
        in_source = run.rows[whole][rows]
        imported = {
            "began_s": run.began_s,
            "steps_s": dict(zip(("shortest", "median", "longest"), sampling.steps_s, strict=True)),
            "irregular_share": sampling.irregular,
            "findings": [finding.as_json() for finding in findings],
            "rows": [int(in_source[0]), int(in_source[-1])],
        }
        metadata = _metadata(settings, recording, cut) | {"imported": imported}
        yield ImportedRecording(recording.name_of(path) + suffix, own, metadata)


def _whole_rows(
    columns: Mapping[str, NDArray], required: Sequence[str], findings: list[Finding]
) -> NDArray:
    """Return a mask of the rows that have every required quantity."""
    known = {name: np.isfinite(values) for name, values in columns.items()}
    for name in required:
        if not known[name].any():
            texts = [str(finding) for finding in findings if finding.action == TAKEN_FOR_MISSING]
            seen = f" ({'; '.join(texts)})" if texts else ""
            raise InputError(
                f"{name} has no value in any row{seen}; correct its column, range or time"
            )
    whole = np.all([known[name] for name in required], axis=0)
    if np.count_nonzero(whole) < FEWEST:
        shares = ", ".join(f"{name} in {np.mean(known[name]):.0%}" for name in required)
        raise InputError(
            f"only {np.count_nonzero(whole)} rows have every quantity ({shares} of the rows). If"
            " they were sampled at different instants, name the clock of each in the map"
        )
    for name, present in known.items():
        missing = len(present) - int(np.count_nonzero(present))
        if missing:
            action = "rows left out" if name in required else "left empty"
            findings.append(Finding(name, f"no value in {counted(missing, 'row')}", action))
    return whole


def _note_sampling(sampling: Sampling, note: Note) -> None:
    if not SLOWEST_HZ <= sampling.rate_hz <= FASTEST_HZ:
        seen = f"{sampling.rate_hz:.4g} Hz, usual are {SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz"
        note(seen, "kept; check time.unit, s or ms, or time.rate_hz")
    if sampling.irregular > 0.05:
        shortest, median, longest = (1e3 * step for step in sampling.steps_s)
        seen = (
            f"irregular: {sampling.irregular:.0%} of the steps are more than 2 % off their median; "
            f"{shortest:.4g} to {longest:.4g} ms, median {median:.4g}"
        )
        note(seen, "stamps kept as they are; later stages average over time, not over rows")
    slow, fast = sampling.rates_hz
    if fast > 1.5 * slow:
        seen = f"rate changes between {fast:.4g} and {slow:.4g} Hz on the way"
        note(seen, "kept; to use the part of one rate only, set span_s in [[recording]]")
    if sampling.gaps:
        seen = (
            f"{counted(len(sampling.gaps), 'gap')}, {counted(sampling.missing, 'sample')} missing,"
            f" the longest {sampling.longest_gap_s:.3g} s"
        )
        note(seen, "listed in `gaps`; nothing is filled in")


def _note_period(
    columns: Mapping[str, NDArray],
    settings: ImportMap,
    wanted: Sequence[RecordingSettings],
    note: Note,
) -> None:
    """Report a period that the map lacks, by which noise is separated from systematic errors."""
    if all(recording.period_s is not None for recording in wanted):
        return
    period_s = repeats_after(columns["time_s"], _motion(columns, settings))
    if period_s is not None:
        seen = f"the motion repeats every {period_s:.6g} s, but the map has no period_s"
        note(seen, f"set period_s = {period_s:.6g} in [[recording]] for exoid diagnose")


def _motion(columns: Mapping[str, NDArray], settings: ImportMap) -> NDArray:
    """Return the set-points of all joints, else their angles, (n, k)."""
    names = [joint.joint.column("reference") for joint in settings.joint]
    if not all(name in columns for name in names):
        names = [joint.joint.column("angle") for joint in settings.joint]
    return np.column_stack([columns[name] for name in names])


def _wrong_periods(
    columns: Mapping[str, NDArray],
    settings: ImportMap,
    wanted: Sequence[RecordingSettings],
    spans: Sequence[slice],
) -> Iterator[Finding]:
    """Report periods of the map after which the motion does not repeat, but after another."""
    motion = _motion(columns, settings)
    for recording, rows in zip(wanted, spans, strict=True):
        if recording.period_s is None:
            continue
        better_s = better_period(columns["time_s"][rows], motion[rows], recording.period_s)
        if better_s is not None:
            seen = (
                f"the motion to {recording.purpose} repeats every {better_s:.6g} s, but not after"
                f" the {recording.period_s:.6g} s of the map's period_s"
            )
            action = (
                f"kept, but differences between periods are taken for noise: set period_s ="
                f" {better_s:.6g}"
            )
            yield Finding("time", seen, action)


def _check_values(columns: Mapping[str, NDArray], settings: ImportMap) -> None:
    """Refuse an angle or torque that no joint has."""
    # N·m or N; far more than any drive delivers at a joint.
    largest_torque = 1e6
    limited = plausibility.limited(settings)
    for i, joint in enumerate(settings.joint):
        unit = joint.joint.unit("torque")
        angle = (
            "angle",
            LARGEST_ANGLE_RAD,
            "rad",
            "zero, counts_per_turn or wraps_at; or set turns = true for a joint that turns without"
            " end",
        )
        torque = ("torque", largest_torque, unit, "scale or gains")
        for quantity, most, unit, also in (angle, torque) if limited[i] else (torque,):
            values = columns[joint.joint.column(quantity)]
            beyond = np.flatnonzero(np.abs(values) > most)
            if len(beyond):
                raise SettingsError(
                    f"joint[{i}].{quantity}: reaches {np.min(values):.4g} to {np.max(values):.4g}"
                    f" {unit}, expected at most {most:.3g} {unit} either way"
                    f" ({counted(len(beyond), 'row')} of {len(values)} beyond, the first"
                    f" {values[beyond[0]]:.4g} at {columns['time_s'][beyond[0]]:.6g} s). Exclude"
                    f" outliers with range, or correct unit, {also}"
                )


def _check_periods(wanted: Sequence[RecordingSettings], duration_s: float) -> None:
    # In lengths of the run, as a run of one period ends a sample before the period does.
    longest_period = 1.01
    for recording in wanted:
        if recording.period_s is not None and recording.period_s > longest_period * duration_s:
            raise SettingsError(
                f"recording.period_s: found {recording.period_s:g} ({recording.purpose}), expected"
                f" at most the {duration_s:.6g} s of the run; correct it, or remove it"
            )


def _turns_apart(
    log: str, columns: Mapping[str, NDArray], turns: Mapping[str, float], begins: Begins
) -> Iterator[Finding]:
    """Report counters that begin more than half a turn from where those of the first log did."""
    for name, turn in turns.items():
        known = columns[name][np.isfinite(columns[name])]
        if not len(known):
            continue
        begin = float(known[0])
        # No log shows its own turn, so the first one is the reference of all others.
        first, first_log = begins.setdefault(name, (begin, log))
        # Less than half a turn may be motion between two logs.
        away = round((begin - first) / turn)
        if away:
            seen = (
                f"begins at {begin:.4g}, in {first_log} at {first:.4g},"
                f" {counted(abs(away), 'turn')} apart"
            )
            yield Finding(
                name, seen, "kept; if all logs begin at the same reading, set begins_at to it"
            )


def _span(time: NDArray, duration_s: float, recording: RecordingSettings) -> slice:
    """Return the rows of a span, with the last row if it reaches to the end."""
    begin, end = 0.0, np.inf
    if recording.span is not None:
        begin, end = (share * duration_s for share in recording.span)
        # A span excludes its end, so that neighbours share no row; only the last one takes it.
        end = np.inf if recording.span[1] == 1.0 else end
    elif recording.span_s is not None:
        begin, end = recording.span_s
    first, last = np.searchsorted(time, [begin, end])
    if last - first < FEWEST:
        end = end if np.isfinite(end) else duration_s
        raise InputError(
            f"{recording.purpose} from {begin:g} to {end:g} s has {last - first} rows of a run of"
            f" {duration_s:.6g} s, expected at least {FEWEST}; correct its span in the map"
        )
    return slice(int(first), int(last))


def _check_overlap(
    time: NDArray, wanted: Sequence[RecordingSettings], spans: Sequence[slice]
) -> None:
    """Refuse samples both to train and to validate."""
    for (one, first), (other, second) in combinations(zip(wanted, spans, strict=True), 2):
        both = slice(max(first.start, second.start), min(first.stop, second.stop))
        # Common samples would make the validation error an error of training.
        if one.purpose != other.purpose and both.start < both.stop:
            begin, end = time[both][[0, -1]]
            raise SettingsError(
                f"{begin:.6g} to {end:.6g} s is both to train and to validate, expected no common"
                " sample; correct the spans of [[recording]] in the map"
            )


def _metadata(
    settings: ImportMap, recording: RecordingSettings, sampling: Sampling
) -> dict[str, Any]:
    known = {
        "rig": settings.rig,
        "subject": recording.subject,
        "session": recording.session,
        "period_s": recording.period_s,
        "geometry": settings.geometry.model_dump(exclude_none=True) or None,
    }
    return {
        "joints": [joint.joint.metadata for joint in settings.joint],
        "run": recording.run,
        "purpose": recording.purpose,
        "sample_rate_hz": sampling.rate_hz,
        "gaps": [list(gap) for gap in sampling.gaps],
    } | {key: value for key, value in known.items() if value is not None}
