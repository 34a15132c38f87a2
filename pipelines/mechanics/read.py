"""Read motions from files: ``motion/1`` directly, ``recording/1`` through the filter."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

from pipelines.contracts import MOTION, RECORDING, contract_of
from pipelines.contracts.joints import in_words
from pipelines.contracts.provenance import sha256
from pipelines.contracts.table import Rows
from pipelines.errors import InputError, SettingsError, about
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.kinematics import filtered, motion_table
from pipelines.mechanics.machine import MECHANISMS, mechanisms_of
from pipelines.mechanics.motion import Motion, motion_from_table
from pipelines.mechanics.run import Run, StoredRun
from pipelines.mechanics.scale import on_one_scale
from pipelines.settings.experiment import Experiment
from pipelines.settings.filter import FilterSettings
from pipelines.settings.mechanism import MechanismSettings
from pipelines.validation.suggestion import suggestion


def geometry_from(experiment: Experiment) -> Geometry | None:
    """Return the geometry in exoid.toml, for recordings without one; None if it has none.

    Raises
    ------
    SettingsError
        If its [mechanism] is unknown.
    """
    settings = experiment.mechanism
    if not settings.model_fields_set:
        return None
    with about(experiment.path):
        _refuse_unknown_mechanism(settings)
    return Geometry(**settings.geometry)


def _refuse_unknown_mechanism(settings: MechanismSettings) -> None:
    names = list(dict.fromkeys(mechanism.name for mechanism in MECHANISMS))
    if settings.name not in names:
        raise SettingsError(
            f"mechanism.name: found {settings.name!r}, expected a mechanism's name, or a file for a"
            f" new one (docs/mechanisms.md); {suggestion(settings.name, names)}"
        )
    its = dict.fromkeys(one.kinds for one in MECHANISMS if one.name == settings.name)
    if settings.kinds not in its:
        others = dict.fromkeys(mechanism.name for mechanism in mechanisms_of(settings.all_joints))
        raise SettingsError(
            f"mechanism.joints: found {in_words(settings.all_joints)}, expected"
            f" {' or '.join(map(', '.join, its))} for {settings.name}; correct the"
            f" joints{''.join(f', or set name to {name}' for name in others)}"
        )


def refuse_another_mechanism(settings: MechanismSettings, runs: Sequence[Run]) -> None:
    """Refuse runs of another mechanism than that of exoid.toml, if it names one.

    Parameters
    ----------
    settings : MechanismSettings
        Table ``[mechanism]`` of exoid.toml.
    runs : sequence of Run
        Runs of any machine.

    Raises
    ------
    InputError
        Names the first file with other kinds of joints.
    """
    for run in runs if settings.model_fields_set else ():
        declared = [(joint.kind, joint.drive) for joint in settings.all_joints]
        recorded = [(joint.kind, joint.drive) for joint in run.machine.joints]
        # Usual joints say nothing of drives: only joints that are listed do.
        if run.machine.mechanism.kinds != settings.kinds or (
            settings.joints and declared != recorded
        ):
            raise InputError(
                f"{run.file} has joints {in_words(run.machine.joints)}, expected those of"
                f" exoid.toml's [mechanism]: {in_words(settings.all_joints)}; correct its name and"
                " joints, or give no exoid.toml: each file names its own mechanism"
            )


def read_motion(
    path: Path, settings: FilterSettings | None = None, default_geometry: Geometry | None = None
) -> Motion:
    """Return the motion in a ``motion/1`` or ``recording/1`` file.

    Parameters
    ----------
    path : Path
        The file.
    settings : FilterSettings, optional
        How a recording is filtered; a motion is filtered already.
    default_geometry : Geometry, optional
        For lengths that the file lacks.

    Returns
    -------
    Motion
        n samples of J joints.

    Raises
    ------
    InputError
        A recording cannot be filtered.
    """
    if contract_of(path) is RECORDING:
        table = motion_table(RECORDING.read(path), settings or FilterSettings())
    else:
        table = MOTION.read(path)
    return motion_from_table(table, default_geometry)


def read_motions(
    paths: Sequence[Path],
    settings: FilterSettings | None = None,
    default_geometry: Geometry | None = None,
) -> list[Motion]:
    """Return the motions in several files.

    Files of one name in several folders are named by their paths.

    Raises
    ------
    InputError
        If two files hold the same data, or a training and a validation run share rows of one log.
    """
    _refuse_twins(paths)
    named = [
        replace(read_motion(path, settings, default_geometry), file=name)
        for path, name in zip(paths, _distinct_names(paths), strict=True)
    ]
    _refuse_seen(named)
    return on_one_scale(named)


def read_runs(
    paths: Sequence[Path], settings: FilterSettings, default_geometry: Geometry | None
) -> list[StoredRun]:
    """Return the runs in several files like ``read_motions``, but piece by piece.

    Parameters
    ----------
    paths : sequence of Path
        Files of ``motion/1`` or ``recording/1``.
    settings : FilterSettings
        How recordings are filtered.
    default_geometry : Geometry or None
        For lengths that the files lack.

    Returns
    -------
    list of StoredRun
        In the order of ``paths``.

    Raises
    ------
    InputError
        Two files hold the same recording, or the runs are of different machines.
    """
    _refuse_twins(paths)
    runs = []
    for path, name in zip(paths, _distinct_names(paths), strict=True):
        rows: Rows
        if contract_of(path) is RECORDING:
            rows = filtered(RECORDING.scan(path), settings)
        else:
            rows = MOTION.scan(path)
        runs.append(StoredRun(rows, default_geometry, name))
    _refuse_seen(runs)
    return on_one_scale(runs)


def _refuse_twins(paths: Sequence[Path]) -> None:
    # A copy would count one run's noise twice, or let a fit see its validation run.
    seen: dict[str, Path] = {}
    for path in paths:
        if path.is_file():
            # Empty or damaged files are alike too; this reports them as damaged first.
            contract_of(path)
            twin = seen.setdefault(sha256(path), path)
            if twin is not path:
                raise InputError(f"{path} holds the same data as {twin}; give each run once")


def _refuse_seen(runs: Sequence[Run]) -> None:
    """Refuse a training and a validation run that were imported from the same rows of a log.

    Runs that were not imported are accepted, because their rows are unknown.
    """
    # Rows that may overlap between adjacent spans, because an import sorts as many that arrived
    # late.
    in_order = 20
    for one, other in combinations(runs, 2):
        shared = _shared_rows(one, other) if one.purpose != other.purpose else 0
        if shared > in_order:
            raise InputError(
                f"{other.file} ({other.purpose}) and {one.file} ({one.purpose}) have {shared} rows"
                f" of {one.metadata['imported']['source']} in common, expected none: validation"
                " needs data that no fit has seen; import them again with spans that do not"
                " overlap"
            )


def _shared_rows(one: Run, other: Run) -> int:
    first, second = (run.metadata.get("imported", {}) for run in (one, other))
    if not set(first.get("sha256", ())) & set(second.get("sha256", ())):
        return 0
    # Rows are given by the first and the last one, both included.
    begin, end = max(first["rows"][0], second["rows"][0]), min(first["rows"][1], second["rows"][1])
    return int(max(0, end - begin + 1))


def _distinct_names(paths: Sequence[Path]) -> list[str]:
    names = [path.name for path in paths]
    return [path.name if names.count(path.name) == 1 else str(path) for path in paths]
