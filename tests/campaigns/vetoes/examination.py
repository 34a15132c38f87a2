"""Examine one session: sound, and with faults of acquisition that are put into it."""

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts import RECORDING
from pipelines.contracts.table import Table
from pipelines.diagnosis.data_faults import find_faults
from pipelines.diagnosis.evidence.eligibility import refuse_unfit
from pipelines.errors import InputError
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import Motion, motion_from_table
from pipelines.mechanics.scale import on_one_scale
from pipelines.settings.filter import FilterSettings
from pipelines.signals.blocks import BlockAverage
from tests.campaigns.vetoes.spoil import SPOILERS, Spoiler


@dataclass(frozen=True)
class Outcome:
    """What became of one session with one fault, or with none."""

    world: str
    session: str
    hidden: str
    """What the session hides besides."""
    fault: str | None
    share: float
    """Share of the error of a model that is right which the fault makes."""
    named: bool
    """Whether a fault of its kind is named in a run that has it, or the files are refused."""
    vetoes: tuple[str, ...]
    """Kinds of the faults that stop the diagnosis."""
    others: tuple[str, ...]
    """Kinds of further faults that are named and are not there."""
    words: str = ""
    """The first veto, or the line that refuses the files."""


def outcomes(
    tables: Sequence[Table], world: str, session: str, hidden: str, number: int, faults: int
) -> Iterator[Outcome]:
    """Yield the outcome of a session as it is, and of some faults in it.

    Parameters
    ----------
    tables : sequence of Table
        Recordings of one machine.
    world, session, hidden : str
        Where it comes from, its name, and what it hides.
    number : int
        The faults are those in turn from this one on.
    faults : int
        How many faults.
    """
    sound = _motions(tables)
    yield _outcome(sound, world, session, hidden)
    model = _model(sound)
    joints = tables[0].joints
    possible = [one for one in SPOILERS if one.joints <= len(joints)]
    for k in range(faults):
        spoiler = possible[(number * faults + k) % len(possible)]
        rng = np.random.default_rng([number, k, 11])
        bad = _spoilt(tables, spoiler, rng)
        try:
            spoilt = _motions(bad)
            share = 1.0 - min(1.0, _error(sound, sound, model) / _error(spoilt, sound, model))
            yield _outcome(spoilt, world, session, hidden, spoiler, _changed(tables, bad), share)
        except InputError as error:
            yield Outcome(world, session, hidden, spoiler.name, 1.0, True, (), (), words=str(error))


def _motions(tables: Sequence[Table]) -> list[Motion]:
    motions = [motion_from_table(motion_table(table, FilterSettings())) for table in tables]
    named = [replace(m, file=t.path.name) for m, t in zip(motions, tables, strict=True) if t.path]
    scaled = on_one_scale(named)
    refuse_unfit(scaled)
    return scaled


def _spoilt(tables: Sequence[Table], spoiler: Spoiler, rng: np.random.Generator) -> list[Table]:
    """Return the recordings with the fault, in one run or in all by the same draw."""
    only, seed = int(rng.integers(len(tables))), int(rng.integers(2**32))
    return [
        replace(t, frame=spoiler.spoil(t.frame, t.joints, np.random.default_rng(seed)))
        if spoiler.everywhere or i == only
        else t
        for i, t in enumerate(tables)
    ]


def _changed(tables: Sequence[Table], bad: Sequence[Table]) -> set[str]:
    pairs = zip(tables, bad, strict=True)
    return {one.path.name for one, other in pairs if one is not other and one.path}


def _outcome(
    motions: Sequence[Motion],
    world: str,
    session: str,
    hidden: str,
    spoiler: Spoiler | None = None,
    files: Iterable[str] = (),
    share: float = 0.0,
) -> Outcome:
    faults = find_faults(motions)
    there = [f for f in faults if spoiler and f.kind in spoiler.kinds and f.file in files]
    vetoes = [fault for fault in faults if fault.spoils]
    return Outcome(
        world,
        session,
        hidden,
        spoiler.name if spoiler else None,
        share,
        bool(there),
        tuple(sorted({fault.kind.value for fault in vetoes})),
        tuple(sorted({fault.kind.value for fault in faults if fault not in there})),
        words=f"{vetoes[0].file}: {vetoes[0].in_words}" if vetoes else "",
    )


def _model(motions: Sequence[Motion]) -> dict[str, NDArray]:
    """Fit rigid body, Coulomb and viscous friction and offsets by least squares, by kind of run."""
    values = {}
    for kind in {motion.run for motion in motions}:
        both = [_blocks(motion) for motion in motions if motion.run == kind]
        Y, tau = (np.concatenate([one[i] for one in both]) for i in range(2))
        weight = 1.0 / np.maximum(tau.std(axis=0), 1e-12)
        columns = (Y * weight[:, np.newaxis]).reshape(-1, Y.shape[2])
        values[kind] = np.linalg.lstsq(columns, (tau * weight).ravel(), rcond=1e-10)[0]
    return values


def _error(motions: Sequence[Motion], sound: Sequence[Motion], model: dict[str, NDArray]) -> float:
    """Return the mean square error of a model, over each joint's variance in the sound runs."""
    variance = np.mean([np.var(_blocks(motion)[1], axis=0) for motion in sound], axis=0)
    errors = []
    for motion in motions:
        Y, tau = _blocks(motion)
        errors.append(np.mean((tau - Y @ model[motion.run]) ** 2, axis=0) / variance)
    return float(np.mean(errors))


def _blocks(motion: Motion) -> tuple[NDArray, NDArray]:
    """Return columns (m, J, p) and torque (m, J) averaged over valid blocks of 0.1 s."""
    block = BlockAverage.lasting(0.1, motion.sample_rate_hz)
    starts = block.starts(motion.segment)
    starts = starts[block.all(motion.valid, starts)]
    q, dq, ddq, sign, tau = (
        block.mean(x, starts)
        for x in (motion.q, motion.dq, motion.ddq, np.sign(motion.dq), motion.torque)
    )
    body = motion.machine.mechanism.regressor(q, dq, ddq, motion.geometry)
    own = [np.zeros((len(q), q.shape[1], 3 * q.shape[1]))]
    for j in range(q.shape[1]):
        own[0][:, j, 3 * j : 3 * j + 3] = np.column_stack([sign[:, j], dq[:, j], np.ones(len(q))])
    return np.concatenate([body, own[0]], axis=2), tau


def read(folder: Path) -> list[Table]:
    """Return the recordings in a folder."""
    return [RECORDING.read(path) for path in sorted(folder.glob("*.parquet"))]


def kept(path: Path, make) -> list[Outcome]:
    """Return the outcomes in a file, after making it where it is not there."""
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part")
        part.write_text(json.dumps([asdict(one) for one in make()], indent=1))
        part.rename(path)
    return [
        Outcome(**(one | {key: tuple(one[key]) for key in ("vetoes", "others")}))
        for one in json.loads(path.read_text())
    ]
