"""From a log and its map to recordings: which rows, which columns, which span."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipelines.contracts import RECORDING, describe, parquet
from pipelines.contracts.checks import LARGEST_ANGLE_RAD
from pipelines.contracts.provenance import metadata_of, sha256
from pipelines.errors import ContractError, InputError, SettingsError, about
from pipelines.importing.finding import Finding, counted
from pipelines.importing.log import Log, read_log
from pipelines.importing.quantities.numbers import TAKEN_FOR_MISSING
from pipelines.importing.quantities.turn_offset import Beginnings
from pipelines.importing.sanity.plausibility import look_at
from pipelines.importing.sources.open import open_source
from pipelines.importing.time.clock import FASTEST_HZ, SLOWEST_HZ, Run, Sampling
from pipelines.importing.time.period import repeats_after
from pipelines.settings.import_map import ImportMap, RecordingSettings

FEWEST = 10
"""Rows that a recording must have at least."""
LARGEST_TORQUE = 1e6
"""N·m or N; beyond it no joint's drive comes near."""
LONGEST_PERIOD = 1.01
"""In runs: one that lasts a period ends a sample before it."""


@dataclass(frozen=True)
class Imported:
    """A recording made of a log, not yet written."""

    name: str
    columns: dict[str, NDArray]
    metadata: dict[str, Any]
    sampling: Sampling
    findings: tuple[Finding, ...]

    def __len__(self) -> int:
        return len(self.columns["time_s"])

    def pieces(self) -> Iterator[pa.Table]:
        """Yield the rows in their order, some at a time."""
        for first in range(0, len(self), parquet.ROWS):
            yield pa.table(
                {
                    name: values[first : first + parquet.ROWS]
                    for name, values in self.columns.items()
                }
            )

    def write(self, folder: Path) -> None:
        """Write the recording into a folder."""
        RECORDING.write_pieces(folder / self.file, self.pieces(), self.metadata)

    @property
    def file(self) -> str:
        """Name of its file."""
        return f"{self.name}.parquet"


def recordings(
    path: Path, settings: ImportMap, map_path: Path, before: Beginnings
) -> Iterator[Imported]:
    """Yield the recordings that a map makes of a log; ``before`` tells where those before it began.

    Raises
    ------
    SettingsError
        Where no ``[[recording]]`` of the map is of this file.
    """
    wanted = [recording for recording in settings.recording if recording.is_of(path)]
    if not wanted:
        patterns = ", ".join(recording.files for recording in settings.recording)
        raise SettingsError(
            f"{map_path}: no [[recording]] is of {path.name}, only of {patterns}; add one"
        )
    with about(path):
        log = read_log(open_source(path, settings.source), settings, map_path)
        provenance = describe(
            inputs=[*_files(path), map_path],
            config=settings.model_dump(mode="json", exclude_none=True),
        )
        given = {"source": path.as_posix(), "map": map_path.as_posix()}
        _refuse_short(log)
        runs = _chosen(log.runs, settings.time.restarts, log.findings)
        for number, run in enumerate(runs, 1):
            suffix = f"_run{number}" if len(runs) > 1 else ""
            yield from _recordings_of(
                run, log, settings, wanted, before, (path, suffix, provenance, given)
            )


def _files(path: Path) -> list[Path]:
    return sorted(file for file in path.iterdir() if file.is_file()) if path.is_dir() else [path]


def _refuse_short(log: Log) -> None:
    if log.rows < FEWEST:
        raise InputError(
            f"found {counted(log.rows, 'row')}, a recording needs at least {FEWEST}; log for longer"
        )
    longest = max(map(len, log.runs), default=0)
    if longest < FEWEST:
        raise InputError(
            f"no run of its clock has {FEWEST} rows, which a recording needs: the longest has"
            f" {longest} of {log.rows}; correct [time] in the map"
        )


def _chosen(runs: Sequence[Run], restarts: str, findings: list[Finding]) -> list[Run]:
    """Return the runs that become recordings."""
    long = [run for run in runs if len(run) >= FEWEST]
    if len(runs) == 1:
        return long
    kept = long if restarts == "split" else [max(long, key=len)]
    told = ", ".join(f"{run.rows[0]}-{run.rows[-1]}" for run in kept)
    lost = sum(map(len, runs)) - sum(map(len, kept))
    done = f"rows {told} kept, {lost} left out" + (
        "" if restarts == "split" else " (time.restarts)"
    )
    findings.append(Finding("time", f"{len(runs)} runs", done))
    return kept


def _recordings_of(
    run: Run,
    log: Log,
    settings: ImportMap,
    wanted: Sequence[RecordingSettings],
    before: Beginnings,
    origin: tuple[Path, str, dict, dict],
) -> Iterator[Imported]:
    path, suffix, provenance, given = origin
    findings = [*log.findings, *run.findings]
    columns = log.quantities(run, findings)
    whole = _whole_rows(columns, log.required, findings)
    time = run.time_s[whole]
    sampling = Sampling.of(run.time_s, time)
    findings += _sampling_findings(sampling)
    columns = {"time_s": time} | {name: values[whole] for name, values in columns.items()}
    _refuse_absurd_angles(columns, settings)
    _refuse_absurd_torques(columns, settings)
    _refuse_long_periods(wanted, float(run.time_s[-1]))
    findings += _period_findings(columns, settings, wanted)
    findings += look_at(columns, settings)
    findings += before.look_at(f"{path.name}{suffix}", columns, log.turns)
    spans = [_span(time, float(run.time_s[-1]), recording) for recording in wanted]
    _refuse_overlap(time, wanted, spans)
    for recording, rows in zip(wanted, spans, strict=True):
        own = {name: values[rows] for name, values in columns.items()}
        begin, end = np.searchsorted(run.time_s, own["time_s"][[0, -1]])
        cut = Sampling.of(run.time_s[begin : end + 1], own["time_s"])
        metadata = _metadata(settings, recording, cut) | provenance
        in_source = run.rows[whole][rows]
        metadata["imported"] = _account(path, log, run, sampling, findings) | {
            "given": given,
            "rows": [int(in_source[0]), int(in_source[-1])],
        }
        yield Imported(recording.name_of(path) + suffix, own, metadata, cut, tuple(findings))


def _account(
    path: Path, log: Log, run: Run, sampling: Sampling, findings: Sequence[Finding]
) -> dict[str, Any]:
    """Return what the recording tells of how it was made."""
    return {
        "source": path.name,
        "sha256": [sha256(file) for file in _files(path)],
        "format": log.source.format,
        "notes": list(log.source.notes),
        "rows_in_source": log.rows,
        "began_s": run.began_s,
        "steps_s": dict(zip(("shortest", "median", "longest"), sampling.steps_s, strict=True)),
        "irregular_share": sampling.irregular,
        "findings": [finding.as_json() for finding in findings],
    }


def _whole_rows(
    columns: Mapping[str, NDArray], required: Sequence[str], findings: list[Finding]
) -> NDArray:
    """Return which rows have every quantity that a recording must have."""
    known = {name: np.isfinite(values) for name, values in columns.items()}
    for name in required:
        if not known[name].any():
            texts = [str(finding) for finding in findings if finding.done == TAKEN_FOR_MISSING]
            seen = f" ({'; '.join(texts)})" if texts else ""
            raise InputError(
                f"{name} has no value in any row{seen}; correct its column, range or time in"
                " the map"
            )
    whole = np.all([known[name] for name in required], axis=0)
    if np.count_nonzero(whole) < FEWEST:
        shares = ", ".join(f"{name} in {np.mean(known[name]):.0%}" for name in required)
        raise InputError(
            f"only {np.count_nonzero(whole)} rows have all of them ({shares} of the rows): they"
            " were sampled at different instants; give those that are to be interpolated a time of"
            " their own in the map"
        )
    for name, present in known.items():
        missing = len(present) - int(np.count_nonzero(present))
        if missing and name in required:
            findings.append(
                Finding(name, f"no value in {counted(missing, 'row')}", "rows left out")
            )
        elif missing:
            findings.append(Finding(name, f"no value in {counted(missing, 'row')}", "left empty"))
    return whole


def _sampling_findings(sampling: Sampling) -> list[Finding]:
    found = []
    if not SLOWEST_HZ <= sampling.rate_hz <= FASTEST_HZ:
        seen = (
            f"{sampling.rate_hz:.4g} Hz, where machines are sampled at {SLOWEST_HZ:g} to"
            f" {FASTEST_HZ:g} Hz"
        )
        found.append(Finding("time", seen, "kept; check time.unit, s or ms, or time.rate_hz"))
    if sampling.irregular > 0.05:
        shortest, median, longest = (1e3 * step for step in sampling.steps_s)
        seen = (
            f"irregular: {sampling.irregular:.0%} of the steps are more than 2 % off their median; "
            f"{shortest:.4g} to {longest:.4g} ms, median {median:.4g}"
        )
        found.append(
            Finding(
                "time",
                seen,
                "stamps kept as they are; exoid filter interpolates angles between them",
            )
        )
    if sampling.gaps:
        longest_gap = max(count for _, count in sampling.gaps) / sampling.rate_hz
        seen = (
            f"{counted(len(sampling.gaps), 'gap')}, {sampling.missing} samples missing, the longest"
            f" {longest_gap:.3g} s"
        )
        found.append(Finding("time", seen, "told in `gaps`; nothing is filled in"))
    return found


def _period_findings(
    columns: Mapping[str, NDArray], settings: ImportMap, wanted: Sequence[RecordingSettings]
) -> list[Finding]:
    """Tell of a period that the map does not: without it noise cannot be told from what repeats."""
    if all(recording.period_s is not None for recording in wanted):
        return []
    asked = [joint.joint.column("reference") for joint in settings.joint]
    motion = (
        asked
        if all(name in columns for name in asked)
        else [j.joint.column("angle") for j in settings.joint]
    )
    period_s = repeats_after(columns["time_s"], np.column_stack([columns[name] for name in motion]))
    if period_s is None:
        return []
    to_do = (
        f"period_s = {period_s:.6g} in [[recording]] lets diagnose measure the noise instead of"
        " guessing it"
    )
    return [
        Finding(
            "time",
            f"the motion repeats every {period_s:.6g} s, of which the map tells nothing",
            to_do,
        )
    ]


def _refuse_absurd_angles(columns: Mapping[str, NDArray], settings: ImportMap) -> None:
    for i, joint in enumerate(settings.joint):
        angle = columns[joint.joint.column("angle")]
        absurd = np.flatnonzero(np.abs(angle) > LARGEST_ANGLE_RAD)
        if joint.kind == "revolute" and len(absurd):
            first = f"{angle[absurd[0]]:.4g} at {columns['time_s'][absurd[0]]:.6g} s"
            raise SettingsError(
                f"joint[{i}].angle: would be {np.min(angle):.4g} to {np.max(angle):.4g} rad,"
                f" expected at most {LARGEST_ANGLE_RAD:.3g} to both sides; beyond it in"
                f" {counted(len(absurd), 'row')} of {len(angle)}, the first {first}; leave slips"
                " out with range, or correct its unit, zero, counts_per_turn or wraps_at in"
                " the map"
            )


def _refuse_absurd_torques(columns: Mapping[str, NDArray], settings: ImportMap) -> None:
    for i, joint in enumerate(settings.joint):
        torque, unit = (
            columns[joint.joint.column("torque")],
            "N·m" if joint.kind == "revolute" else "N",
        )
        absurd = np.flatnonzero((torque > LARGEST_TORQUE) | (torque < -LARGEST_TORQUE))
        if len(absurd):
            first = f"{torque[absurd[0]]:.4g} {unit} at {columns['time_s'][absurd[0]]:.6g} s"
            raise SettingsError(
                f"joint[{i}].torque: would be {first}, and beyond {LARGEST_TORQUE:g} {unit}, which"
                f" no drive delivers, in {counted(len(absurd), 'row')}; leave slips out with range,"
                " or correct unit, scale and what follows it in the map"
            )


def _refuse_long_periods(wanted: Sequence[RecordingSettings], duration_s: float) -> None:
    for recording in wanted:
        if recording.period_s is not None and recording.period_s > LONGEST_PERIOD * duration_s:
            raise SettingsError(
                f"recording.period_s: found {recording.period_s:g} ({recording.purpose}), expected"
                f" at most the {duration_s:.6g} s of the run, for an excitation that repeats;"
                " correct it, or remove it"
            )


def _span(time: NDArray, duration_s: float, recording: RecordingSettings) -> slice:
    """Return the rows of a span; one that reaches to the end has the last row."""
    begin, end = 0.0, np.inf
    if recording.span is not None:
        begin, end = (share * duration_s for share in recording.span)
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


def _refuse_overlap(
    time: NDArray, wanted: Sequence[RecordingSettings], spans: Sequence[slice]
) -> None:
    """Refuse to judge a fit on samples that it was made from."""
    for (one, first), (other, second) in combinations(zip(wanted, spans, strict=True), 2):
        both = slice(max(first.start, second.start), min(first.stop, second.stop))
        if one.purpose != other.purpose and both.start < both.stop:
            begin, end = time[both][[0, -1]]
            raise SettingsError(
                f"{begin:.6g} to {end:.6g} s would be to train and to validate, expected no sample"
                " in both: a fit is judged on data that it has not seen; correct the spans of"
                " [[recording]] in the map"
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
        "joints": [{"name": joint.name, "kind": joint.kind} for joint in settings.joint],
        "run": recording.run,
        "purpose": recording.purpose,
        "sample_rate_hz": sampling.rate_hz,
        "gaps": [list(gap) for gap in sampling.gaps],
    } | {key: value for key, value in known.items() if value is not None}


def refuse_to_overwrite(path: Path) -> None:
    """Refuse to put a recording where something else stands: another file, or a recording that was
    not imported."""
    RECORDING.refuse_place(path)
    told = metadata_of(path)
    if told.get("contract") == RECORDING.label and "imported" not in told:
        raise ContractError(
            f"{path}: holds a recording that was not imported, not overwritten; choose another"
            " folder"
        )
