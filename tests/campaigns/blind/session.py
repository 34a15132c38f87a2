"""A whole session: its runs in files that say nothing, its truth in a file that nobody may read."""

import hashlib
import json
import shutil
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.random import Generator
from numpy.typing import NDArray

from tests.campaigns.blind import recorder
from tests.campaigns.blind.cases import Case
from tests.campaigns.blind.causes import BOUNDS, SOFT, Cause, Reach, log_uniform, random_cause
from tests.campaigns.blind.conditions import PLAIN, Conditions, random_conditions
from tests.campaigns.blind.excitation import PERIOD_S
from tests.campaigns.blind.faults import IN_EVERY_RUN, fault_named
from tests.campaigns.blind.floor import left_by_the_baseline, noise_floor, ripple_floor
from tests.campaigns.blind.imperfections import random_background, random_imperfections
from tests.campaigns.blind.magnitude import rms, size_for, small_size_for
from tests.campaigns.blind.mechanisms import MECHANISMS, Mechanism
from tests.campaigns.blind.outside import random_outside
from tests.campaigns.blind.plan import HIP, JOINTS, KNEE, Plan, Run
from tests.campaigns.blind.plant import record
from tests.campaigns.blind.recorded import Recorded, Rig
from tests.campaigns.blind.smooth import SPRING
from tests.campaigns.blind.temperature import Warmth
from tests.campaigns.blind.trajectories import (
    ANOTHER_TO_VALIDATE,
    Trajectory,
    random_family,
    random_trajectory,
)
from tests.campaigns.blind.worlds import WORLDS

LEAST, MOST = 0.03, 0.25
"""Magnitudes of what is hidden."""
PILOT_S = 12.0
LONGEST_PILOT_S = 20.0
"""How long a cause is tried for, where a period takes longer or there is none."""
SHORT_PILOT_S = 7.0
ATTEMPTS = 6
LEAST_MOVING, LEAST_MOVING_ANYHOW = 0.4, 0.15
"""Share of a run in which each joint has to be away from reversals; the latter where a motion may
hold still."""
OF_FLOOR, OF_TORQUE = 0.35, 0.006
"""How much rigid body and friction may leave of a good rig's small effects: of the noise floor, of
the torque's rms, whichever is larger."""
LATER = np.arange(0.0, 20.0, 0.05)
"""Instants at which motions are looked at."""
RUNS = 4
GREATEST = {"stribeck_friction": 15.0, "presliding_hysteresis": 15.0}
"""Sizes beyond which a lab would mend the machine, N·m; plain cases know none."""
PURPOSES = ("train", "validate")


@dataclass(frozen=True)
class Session:
    """One session in memory."""

    case: Case
    rig: Rig
    hidden: list[tuple[Cause, float, float]]
    """Cause, size, wanted magnitude."""
    runs: list[Recorded]
    conditions: Conditions = PLAIN
    trajectories: Mapping[str, Trajectory] = field(default_factory=dict)
    """Motions by purpose; empty where they are plain, and so are clocks and headers then."""
    background: list[tuple[Cause, float, float]] = field(default_factory=list)
    """Small effects that are there besides: cause, size, magnitude."""

    @property
    def mechanism(self) -> Mechanism:
        """What was moved and recorded."""
        return MECHANISMS[self.case.machine]

    def of(self, purpose: str) -> list[Recorded]:
        """Return the runs with this purpose."""
        return [r for r in self.runs if r.run.purpose == purpose]


def simulate(case: Case) -> Session:
    """Draw a rig, a person and what is hidden, and simulate all runs; the case's seed decides
    everything.

    A leg that a hidden effect makes unstable or stuck is drawn again: no lab would record it.
    """
    for attempt in range(ATTEMPTS):
        try:
            return (_PlainDraw if case.plain else _Draw)(case, attempt).session()
        except FloatingPointError:
            continue
    raise FloatingPointError(f"seed {case.seed}: {ATTEMPTS} legs in a row were unstable")


class _Draw:
    """Everything that a case's seed draws, each part from a stream of its own."""

    least_moving = LEAST_MOVING_ANYHOW

    def __init__(self, case: Case, attempt: int) -> None:
        self.case = case
        self.stream = [case.seed, 2, attempt]
        self.mechanism = MECHANISMS[case.machine]
        self._draw(self.rng(0))

    def _draw(self, rng: Generator) -> None:
        world = WORLDS[self.case.world]
        self.world, self.record = world.name, world.record
        self.conditions = random_conditions(rng)
        self.duration = self.conditions.duration_s
        self.rig = world.rig(rng)
        family = random_family(rng)
        families = {
            "train": family,
            "validate": random_family(rng) if rng.random() < ANOTHER_TO_VALIDATE else family,
        }
        self.motion = {
            purpose: random_trajectory(
                rng, self.duration, self.conditions.periodic, families[purpose]
            )
            for purpose in PURPOSES
        }
        self.softness = rng.uniform(0.0, 0.25, 2)
        self.warmth = Warmth(rng, RUNS)
        self.temperature_range = self.warmth.range(dict.fromkeys(range(RUNS), self.duration))
        self.reach = _common_reach([m.at(LATER)[0] for m in self.motion.values()])

    def rng(self, *part: int) -> Generator:
        return np.random.default_rng([*self.stream, *part])

    def session(self) -> Session:
        wanted_causes = self._wanted()
        for cause, _ in wanted_causes:
            if cause.effect in SOFT:
                self.rig = replace(self.rig, machine=self.rig.machine.tuned_for_soft(cause.joint))
        hidden = [(cause, self._size(cause, wanted), wanted) for cause, wanted in wanted_causes]
        background = [
            (cause, self._small_size(cause, wanted), wanted) for cause, wanted in self._background()
        ]
        runs = [(kind, purpose) for kind in self.case.kinds for purpose in PURPOSES]
        causes = [(cause, size) for cause, size, _ in hidden + background]
        recorded = [self._record(causes, kind, purpose, self.duration) for kind, purpose in runs]
        joints = len(self.mechanism.joints)
        if min(r.moving().mean(axis=0)[:joints].min() for r in recorded) < self.least_moving:
            raise FloatingPointError("the simulated machine is stuck most of the time")
        if self.case.category == "none":
            self._check_background(recorded)
        return Session(
            self.case, self.rig, hidden, recorded, self.conditions, self._trajectories(), background
        )

    def _check_background(self, runs: list[Recorded]) -> None:
        """Refuse a rig whose small effects add up to something that ought to be named."""
        if self.case.plain:
            return
        residual = left_by_the_baseline(self.rig, runs)
        torque = np.sqrt(np.mean([np.mean(r.torque**2, axis=0) for r in runs], axis=0))
        if np.any(residual > np.maximum(OF_FLOOR * ripple_floor(runs), OF_TORQUE * torque)):
            raise FloatingPointError("what a good rig gets a little wrong is large")

    def _trajectories(self) -> dict[str, Trajectory]:
        return self.motion

    def _wanted(self) -> list[tuple[Cause, float]]:
        rng = self.rng(1)
        if self.case.category == "imperfect":
            return self._imperfections(rng)
        wanted = []
        for effect, joint in self.case.hidden:
            if effect.startswith("outside:"):
                cause = random_outside(rng, effect.removeprefix("outside:"), joint, self.reach)
            else:
                cause = random_cause(rng, effect, joint, world=self.world, reach=self.reach)
            if effect in GREATEST and not self.case.plain:
                cause = replace(cause, largest=min(cause.largest, GREATEST[effect]))
            wanted.append((cause, log_uniform(rng, LEAST, MOST)))
        return wanted

    def _imperfections(self, rng: Generator) -> list[tuple[Cause, float]]:
        return random_imperfections(rng, self.mechanism.small, self.world)

    def _background(self) -> list[tuple[Cause, float]]:
        if self.case.category == "imperfect":
            return []
        return random_background(self.rng(6), self.world, self.case.hidden)

    def _size(self, cause: Cause, wanted: float) -> float:
        if self.case.category == "imperfect":
            return self._small_size(cause, wanted)
        kinds = [kind for kind in self.case.kinds if cause.acts_in(kind)]
        # What changes over a whole run needs a whole one, but not each run.
        periods = [motion.period_s or LONGEST_PILOT_S for motion in self.motion.values()]
        pilot_s = float(np.clip(max(periods), PILOT_S, LONGEST_PILOT_S))
        duration = self.duration if cause.slow else min(pilot_s, self.duration)
        each = cause.follows_temperature or not cause.slow
        purposes = PURPOSES if each else PURPOSES[:1]

        def pilot(size: float) -> list[Recorded]:
            return [
                self._record([(cause, size)], kind, purpose, duration)
                for kind, purpose in product(kinds, purposes)
            ]

        return size_for(cause, wanted, pilot, must_act=True)

    def _small_size(self, cause: Cause, wanted: float) -> float:
        kind = next(kind for kind in reversed(self.case.kinds) if cause.acts_in(kind))
        duration = self.duration if cause.slow else min(SHORT_PILOT_S, self.duration)
        return small_size_for(
            cause, wanted, lambda size: [self._record([(cause, size)], kind, "train", duration)]
        )

    def _record(
        self, causes: list[tuple[Cause, float]], kind: str, purpose: str, duration: float
    ) -> Recorded:
        number = 2 * (kind == "with_human") + (purpose == "validate")
        warm = None if self.case.plain else self.warmth.curve(number, duration)
        run = Run(kind, purpose, duration, self.rng(2, number), warm, self.temperature_range)
        plan = Plan()
        self.rig.load(plan)
        if self.case.category != "none" and run.has_human:
            # Relaxed muscles are a little elastic: far below what is hidden.
            for j, rest in ((HIP, 0.5), (KNEE, -0.9)):
                plan.torque(SPRING, j, self.softness[j], rest, 0.0, 0.1, human=True)
        for cause, size in causes:
            cause.install(plan, size, run)
        recorded = self.record(
            self.rig, self.motion[purpose], plan, run, self.rng(3, number), self.conditions
        )
        if self._needs_temperature(causes):
            recorded = replace(recorded, temperature=_sampled(warm, recorded.time))
        return recorded

    def _needs_temperature(self, causes: list[tuple[Cause, float]]) -> bool:
        return self.conditions.has_temperature or any(
            cause.follows_temperature for cause, _ in causes
        )


def _common_reach(angles: list[NDArray]) -> Reach:
    """Return least and greatest angles that all motions come to, (2,) each."""
    low = np.max([a.min(axis=0) for a in angles], axis=0)
    return low, np.min([a.max(axis=0) for a in angles], axis=0)


def _sampled(curve: NDArray, time: NDArray) -> NDArray:
    at = np.arange(len(curve)) / 50.0
    return np.column_stack([np.interp(time, at, curve[:, j]) for j in range(2)])


class _PlainDraw(_Draw):
    """The draws of the first examinations, which the fixed set keeps."""

    least_moving = LEAST_MOVING

    def _draw(self, rng: Generator) -> None:
        self.world, self.record, self.conditions = None, record, PLAIN
        self.temperature_range, self.reach = None, BOUNDS
        self.rig = self.mechanism.rig(rng)
        self.motion = {purpose: self.mechanism.excitation(rng) for purpose in PURPOSES}
        if self.case.machine != "leg":
            self.reach = _common_reach([m.at(LATER)[0] for m in self.motion.values()])
        self.duration = float(rng.choice([60.0, 70.0, 80.0]))
        self.softness = rng.uniform(0.0, 0.25, 2)

    def _trajectories(self) -> dict[str, Trajectory]:
        return {}

    def _background(self) -> list[tuple[Cause, float]]:
        return []

    def _size(self, cause: Cause, wanted: float) -> float:
        kinds = [kind for kind in self.case.kinds if cause.acts_in(kind)]
        duration = self.duration if cause.slow else PILOT_S

        def pilot(size: float) -> list[Recorded]:
            return [
                self._record([(cause, size)], kind, purpose, duration)
                for kind, purpose in product(kinds, PURPOSES)
            ]

        return size_for(cause, wanted, pilot)


def write(session: Session, recordings: Path, truth: Path) -> None:
    """Write a session's recordings into a new folder, and its truth into a file elsewhere."""
    shutil.rmtree(recordings, ignore_errors=True)
    recordings.mkdir(parents=True)
    rng = np.random.default_rng([session.case.seed, 4])
    names = [f"run_{number}.parquet" for number in rng.permutation(len(session.runs)) + 1]
    label = hashlib.sha256(f"session {session.case.seed}".encode()).hexdigest()[:8]
    tables = [session.mechanism.columns(session.rig, r) for r in session.runs]
    gaps: dict[int, recorder.Gaps] = {}
    if session.trajectories:
        clock = np.random.default_rng([session.case.seed, 7])
        tables = [
            recorder.stamped(t, r, session.conditions, clock)
            for t, r in zip(tables, session.runs, strict=True)
        ]
        if session.conditions.gaps and not session.case.fault:
            lossy = int(clock.integers(len(tables)))
            tables[lossy], gaps[lossy] = recorder.with_gaps(
                tables[lossy], session.conditions.gaps, clock
            )
    fault = _spoil(session, tables, names, rng) if session.case.fault else None
    for i, (r, columns, name) in enumerate(zip(session.runs, tables, names, strict=True)):
        table = pa.table({key: pa.array(values) for key, values in columns.items()})
        metadata = _header(session, r, label) | ({"gaps": gaps[i]} if i in gaps else {})
        header = json.dumps(metadata).encode()
        pq.write_table(table.replace_schema_metadata({b"exoid": header}), recordings / name)
    truth.parent.mkdir(parents=True, exist_ok=True)
    # Last and whole: a truth that is there means that the session is complete.
    part = truth.with_suffix(".part")
    part.write_text(json.dumps(_truth(session, names, fault, [names[i] for i in gaps]), indent=1))
    part.rename(truth)


def _header(session: Session, r: Recorded, label: str) -> dict[str, Any]:
    known = session.mechanism.header(session.rig, r)
    if session.trajectories:
        about = {
            "contract": "recording/1",
            "run": r.run.kind,
            "purpose": r.run.purpose,
            "session": label,
        }
        period = session.trajectories[r.run.purpose].period_s
        return about | recorder.header(known, session.conditions, period)
    return {
        "contract": "recording/1",
        "run": r.run.kind,
        "purpose": r.run.purpose,
        "sample_rate_hz": 200.0,
        "period_s": PERIOD_S,
        "session": label,
        **known,
    }


def _spoil(
    session: Session, tables: list[dict], names: list[str], rng: Generator
) -> dict[str, Any]:
    """Put the case's fault into one run, or into all where it is one of the wiring."""
    name = session.case.fault
    spoil, joint = fault_named(name), int(rng.integers(2))
    chosen = range(len(tables)) if name in IN_EVERY_RUN else [int(rng.integers(len(tables)))]
    # The same stream for every run: a wrong unit is the same wrong unit everywhere.
    seed = int(rng.integers(2**32))
    channel = [spoil(tables[i], np.random.default_rng(seed), joint) for i in chosen]
    return {"fault": name, "files": [names[i] for i in chosen], "channel": channel[0]}


def _truth(
    session: Session, names: list[str], fault: dict[str, Any] | None, with_gaps: list[str]
) -> dict[str, Any]:
    validate, rig = session.of("validate"), session.rig

    def by_joint(values: np.ndarray) -> dict[str, float]:
        joints = session.mechanism.joints
        # Of a machine of one joint, what would be the knee is no joint.
        own = rig.units.factor(1, 0) * np.asarray(values, float)[: len(joints)]
        return dict(zip(joints, own.tolist(), strict=True))

    return {
        "case": session.case.as_dict(),
        "hidden": [_hidden(session, *one) for one in session.hidden],
        "background": [
            {
                "effect": cause.effect,
                "joint": None if cause.joint is None else JOINTS[cause.joint],
                "form": cause.form,
                "magnitude": share,
            }
            for cause, _, share in session.background
        ],
        "fault": fault,
        "with_gaps": with_gaps,
        "conditions": asdict(session.conditions),
        "motions": {purpose: t.family for purpose, t in session.trajectories.items()},
        "noise_floor_nm": by_joint(noise_floor(rig, validate)),
        "ripple_floor_nm": by_joint(ripple_floor(validate)),
        "left_by_baseline_nm": by_joint(left_by_the_baseline(rig, session.runs)),
        "torque_rms_nm": by_joint(
            np.sqrt(np.mean([np.mean(r.torque**2, axis=0) for r in validate], axis=0))
        ),
        "runs": [
            {
                "file": name,
                "run": r.run.kind,
                "purpose": r.run.purpose,
                "duration_s": r.run.duration_s,
            }
            for name, r in zip(names, session.runs, strict=True)
        ],
        **session.mechanism.truth(rig, session.case.kinds),
    }


def _hidden(session: Session, cause: Cause, size: float, wanted: float) -> dict[str, Any]:
    # In company an effect cannot be measured by itself; what its own pilot was set to is near
    # enough.
    effect, torque = rms(cause, session.runs)
    share = effect / torque if len(session.hidden) == 1 else wanted
    return {
        "effect": cause.effect,
        "joint": None if cause.joint is None else session.mechanism.joints[cause.joint],
        "form": cause.form,
        "own_form": cause.own,
        # What the form is drawn and installed with, so the simulated leg's; parameters are the
        # recording's.
        "size": size,
        "shape": [float(x) for x in cause.shape],
        "families": list(cause.families),
        "repeats": cause.repeats,
        "held_back": cause.held_back,
        "at_both_joints": cause.at_both_joints,
        "parameters": session.rig.units.converted(cause.effect, cause.parameters(size)),
        "kin": list(cause.kin),
        "wanted_magnitude": wanted,
        "magnitude": share,
        "rms_nm": session.rig.units.factor(1, 0) * share * torque,
    }
