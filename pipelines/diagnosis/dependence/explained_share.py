"""Rank the variables on which the residual depends, for causes that are not known yet.

Each variable that the runs have (angle, speed, load, time, phase, ...) is given a smooth curve,
fitted on all folds but one and judged on that one. Folds are whole periods, so that noise, coloured
noise included, gains nothing. The share of the residual's variance that a curve predicts ranks the
variables.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.joints import either, the
from pipelines.diagnosis.dependence.smooth_curve import Curve, fold_products, held_out_error
from pipelines.diagnosis.evidence.motion_band import above_the_motion_hz
from pipelines.diagnosis.evidence.noise_floor import Floor
from pipelines.diagnosis.evidence.observed_run import FOLDS, Run
from pipelines.mechanics.machine import Machine

if TYPE_CHECKING:
    from pipelines.diagnosis.dependence.smooth_term import Surface


@dataclass(frozen=True)
class Variable:
    """Something that a residual may depend on."""

    name: str
    words: str
    """Its name in sentences; ``{joint}``, ``{place}`` and ``{effort}`` are filled in, and
    ``{other}`` with its own."""
    unit: str
    of: Callable[[Run, int], NDArray | None]
    """(m,) values in a run for a joint; None where the run does not have it."""
    by_direction: bool = False
    """Whether each direction of motion has a curve of its own."""
    lasting: bool = True
    """Whether another run, of another excitation, must show the same."""
    knots: int = 8
    """Inner knots of its curve; few where a fold leaves a gap as long as a knot's span."""


def _angle(run: Run, j: int) -> NDArray:
    """Return a joint's angle; within a turn if it turns without end."""
    q = run.state[0][:, j]
    return (q + np.pi) % (2.0 * np.pi) - np.pi if run.motion.machine.joints[j].turns else q


def _of_other(run: Run, order: int, j: int) -> NDArray | None:
    """Return angle, speed or acceleration of the other of two joints."""
    return run.state[order][:, 1 - j] if len(run.motion.joints) == 2 else None


def _load_of_other(run: Run, j: int) -> NDArray | None:
    two = len(run.motion.joints) == 2
    return _load(run, 1 - j) if two and run.motion.machine.measured.all() else None


def _since_reversal(run: Run, j: int) -> NDArray:
    forward = run.state[1][:, j] > 0
    turned = np.flatnonzero(np.diff(forward, prepend=forward[0]))
    last = np.searchsorted(turned, np.arange(len(forward)), side="right") - 1
    # Largest time since a reversal that is distinguished, s.
    longest_s = 2.0
    # Before the first reversal the time since one is unknown, and counts as long.
    since = np.where(
        last >= 0, run.time - run.time[turned[last]] if len(turned) else 0.0, longest_s
    )
    return np.minimum(since, longest_s)


def _load(run: Run, j: int) -> NDArray:
    return run.average(run.motion.transmitted[0])[:, j]


def _cuff(run: Run, j: int) -> NDArray | None:
    return run.measured[:, len(run.motion.joints) + j] if run.has_cuffs else None


def _temperature(run: Run, j: int) -> NDArray | None:
    if run.motion.temperature is None:
        return None
    read = run.average(run.motion.interpolated_temperature)[:, j]
    return read if np.isfinite(read).all() else None


def _phase(run: Run, j: int) -> NDArray | None:
    period = run.motion.period_s
    return None if not period else run.time % period


VARIABLES = (
    Variable("angle", "{joint}'s {place}", "rad", _angle),
    # Friction jumps where the joint reverses.
    Variable(
        "speed", "{joint}'s speed", "rad/s", lambda run, j: run.state[1][:, j], by_direction=True
    ),
    Variable("acceleration", "{joint}'s acceleration", "rad/s²", lambda run, j: run.state[2][:, j]),
    Variable(
        "reversals",
        "{joint}'s direction and the time since it reversed",
        "s",
        _since_reversal,
        by_direction=True,
    ),
    Variable("load", "the {effort} that {joint} passes on", "N·m", _load, by_direction=True),
    Variable("other_angle", "{other}'s {other_place}", "rad", lambda run, j: _of_other(run, 0, j)),
    Variable("other_speed", "{other}'s speed", "rad/s", lambda run, j: _of_other(run, 1, j)),
    Variable("other_load", "the {other_effort} that {other} passes on", "N·m", _load_of_other),
    Variable("cuff_force", "the cuffs' torque about {joint}", "N·m", _cuff),
    Variable("temperature", "the temperature of {joint}'s motor", "°C", _temperature),
    Variable(
        "time", "the time since the run began", "s", lambda run, j: run.time, lasting=False, knots=2
    ),
    Variable(
        "phase",
        "the phase of the excitation and no single variable of the motion",
        "s",
        _phase,
        lasting=False,
    ),
)


@dataclass(frozen=True)
class Dependence:
    """The share of a joint's residual that one variable predicts."""

    joint: str
    variable: str
    share: float
    """Of the residual's variance, on folds that the curve was not fitted to; 0 for noise."""
    sentence: str


@dataclass(frozen=True)
class Excess:
    """The part of a run's residual above the noise floor."""

    joint: str
    file: str
    run: str
    rms_nm: float
    floor_nm: float

    @property
    def square(self) -> float:
        """Square of the part that is not noise, (N·m)²."""
        return max(self.rms_nm**2 - self.floor_nm**2, 0.0)


def dependences(runs: Sequence[Run], residuals: Sequence[NDArray]) -> list[Dependence]:
    """Rank the dependences of the residuals (m, O) of the drives, joint by joint.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        Measured less predicted torque of each run, N·m.

    Returns
    -------
    list of Dependence
        Of each joint in turn, the largest first.
    """
    machine = runs[0].motion.machine
    results = []
    for j, joint in enumerate(machine.names):
        # Without a measured torque there is no residual.
        if not machine.measured[j]:
            continue
        shares = {v: variable_share(v, runs, residuals, j) for v in VARIABLES if knows(v, runs, j)}
        terms = []
        for v, share in shares.items():
            sentence = f"{_unexplained(joint, share)} depends on {_words(joint, machine, v.words)}"
            terms.append(Dependence(joint, v.name, share, sentence))
        # A hum may lie above the cut-off that noisy angles require, so tones get that torque back.
        fast = [run.with_fast(r) for run, r in zip(runs, residuals, strict=True)]
        frequency, share, in_step = tone(runs, fast, j)
        kind = (
            "above the motion's own band, in step with its period"
            if in_step
            else "that is no harmonic of the motion"
        )
        sentence = f"{_unexplained(joint, share)} is a tone of {frequency:.2f} Hz {kind}"
        terms.append(Dependence(joint, "tone", share, sentence))
        results += sorted(terms, key=_rank, reverse=True)
    return results


def _rank(dependence: Dependence) -> float:
    # Weight of the phase in the ranking. It can imitate everything that repeats, so others go
    # first.
    of_phase = 0.5
    return dependence.share * (of_phase if dependence.variable == "phase" else 1.0)


def knows(variable: Variable, runs: Iterable[Run], j: int) -> bool:
    """Return whether any run has the variable."""
    return any(variable.of(run, j) is not None for run in runs)


def _unexplained(joint: str, share: float) -> str:
    return f"{100 * share:.0f} % of the remaining error at {the(joint)}"


def _words(joint: str, machine: Machine, words: str) -> str:
    own, others = machine.joint(joint), [other for other in machine.joints if other.name != joint]
    return words.format(
        joint=the(joint),
        place=own.place,
        effort=own.effort,
        other=" and ".join(the(other.name) for other in others),
        other_place=either(other.place for other in others),
        other_effort=either(other.effort for other in others),
    )


def by_kind(
    runs: Sequence[Run], residuals: Sequence[NDArray]
) -> Iterable[tuple[list[Run], list[NDArray]]]:
    """Yield the runs of each kind with their residuals (m, O).

    An effect that hides in one kind need not be in the other.
    """
    for kind in dict.fromkeys(run.motion.run for run in runs):
        chosen = [i for i, run in enumerate(runs) if run.motion.run == kind]
        yield [runs[i] for i in chosen], [residuals[i] for i in chosen]


def variable_share(
    variable: Variable, runs: Sequence[Run], residuals: Sequence[NDArray], j: int
) -> float:
    """Return the share of a joint's residual variance that curves along a variable predict.

    Parameters
    ----------
    variable : Variable
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        N·m of each run.
    j : int
        Number of the joint.
    """
    total = error = 0.0
    for some, of_kind in by_kind(runs, residuals):
        y = pooled(some, [r[:, j] for r in of_kind], j)
        if not len(y):
            continue
        # A constant is no dependence, and each kind of run may have its own.
        y = y - y.mean()
        total += float(y @ y)
        if not knows(variable, some, j):
            # A kind of run without the variable counts as not predicted.
            error += float(y @ y)
            continue
        curve = Curve.along([variable], some, j)
        design = pooled(some, [curve.design(run) for run in some], j)
        error += held_out_error(fold_products(design, y, _folds(variable, some, j)))[0]
    return max(1.0 - error / total, 0.0) if total > 0 else 0.0


def _folds(variable: Variable, runs: Sequence[Run], j: int) -> list[NDArray]:
    periods = pooled(runs, [run.fold for run in runs], j)
    return (
        [periods, pooled(runs, [parts_of_period(run) for run in runs], j)]
        if variable.lasting
        else [periods]
    )


def parts_of_period(run: Run) -> NDArray:
    """Assign the parts of the excitation's period to folds.

    A law learnt in some parts of the period predicts the others; a curve that only imitates the
    repeating residual does not. Without a period, stretches of a second are assigned.

    Parameters
    ----------
    run : Run
        m blocks.

    Returns
    -------
    (m,) int array
        Fold of each block.
    """
    # Number of parts of the excitation's period that are assigned to folds.
    parts = 12
    length = (run.motion.period_s or parts) / parts
    # Rounding must not put a block at a border into the part before it.
    return np.floor(run.time / length + 1e-9).astype(int) % parts % FOLDS


def pooled(runs: Sequence[Run], values: Sequence[NDArray], j: int) -> NDArray:
    """Return the values of all runs where a joint's blocks are usable.

    Parameters
    ----------
    runs : sequence of Run
        Runs of m blocks each.
    values : sequence of (m, ...) arrays
        One of each run.
    j : int
        Number of the joint.

    Returns
    -------
    array
        Rows of all runs, in their order.
    """
    return np.concatenate([v[run.usable[:, j]] for run, v in zip(runs, values, strict=True)])


def tone(runs: Sequence[Run], residuals: Sequence[NDArray], j: int) -> tuple[float, float, bool]:
    """Return the strongest tone that no period of the motion explains, and its share.

    Where a harmonic of the motion's period, above twice the motion's own band, predicts most, it is
    that one: a motor that hums while it is recorded may do so in step.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        N·m of each run.
    j : int
        Number of the output.

    Returns
    -------
    float
        Frequency, Hz.
    float
        Share of the variance that it predicts.
    bool
        Whether it is in step with the motion.
    """
    # Lowest frequency of a tone, below which it is a drift, Hz.
    lowest_hz = 0.2
    # A tone that is no harmonic of the motion lies in what does not repeat between periods.
    free = _tone_in(_unrepeated, lowest_hz, runs, residuals, j)
    if not any(run.motion.period_s for run in runs):
        return (*free, False)
    above = max(above_the_motion_hz(run) for run in runs)
    # Below this frequency a law of the motion has lines that look like a tone in step.
    in_step = _tone_in(_repeated, above, runs, residuals, j)
    # Share that a tone in step with the motion must predict. A law of the motion has many lines
    # there.
    least_share = 0.5
    return (*in_step, True) if in_step[1] > max(least_share, free[1]) else (*free, False)


def _tone_in(
    part: Callable[[Run, NDArray, NDArray], NDArray],
    above: float,
    runs: Sequence[Run],
    residuals: Sequence[NDArray],
    j: int,
) -> tuple[float, float]:
    """Return the strongest frequency (Hz) of a part of the residuals (m, O), and its share.

    The frequency is shared by all runs, amplitude and phase are each run's own. Both are fitted on
    all folds but one and judged on that one.
    """
    total = error = 0.0
    tones = []
    # The frequency is sought without the judged fold too, or noise alone predicts something.
    for held in range(FOLDS):
        rest = [run.usable[:, j] & (run.fold != held) for run in runs]
        frequency = _strongest(
            runs,
            [part(run, e[:, j], r) for run, e, r in zip(runs, residuals, rest, strict=True)],
            above,
        )
        tones.append(frequency)
        for run, learnt, residual in zip(runs, rest, residuals, strict=True):
            judged = run.usable[:, j] & (run.fold == held)
            if not learnt.any():
                continue
            # Runs share the frequency only: the phase of a hum differs at each start.
            angle = 2 * np.pi * frequency * run.time
            A = np.column_stack([np.sin(angle), np.cos(angle), np.ones(len(angle))])
            values = np.linalg.lstsq(A[learnt], residual[learnt, j], rcond=None)[0]
            # The comparison is with a constant from the same folds, which needs no tone.
            mean = residual[learnt, j].mean()
            total += float(np.sum((residual[judged, j] - mean) ** 2))
            error += float(np.sum((residual[judged, j] - A[judged] @ values) ** 2))
    return float(np.median(tones)), max(1.0 - error / total, 0.0) if total > 0 else 0.0


def _unrepeated(run: Run, residual: NDArray, learnt: NDArray) -> NDArray:
    """Return the part of a residual (m,) that does not repeat, zero where not ``learnt``."""
    kept = np.where(learnt, residual, 0.0)
    if not run.motion.period_s:
        return kept
    width = run.block.decimation / run.motion.sample_rate_hz
    place = np.round(run.time % run.motion.period_s / width).astype(int)
    # Rows that are not learnt are zero and do not count in the mean of their phase.
    mean = np.bincount(place, kept) / np.maximum(np.bincount(place, learnt), 1)
    return np.where(learnt, kept - mean[place], 0.0)


def _repeated(run: Run, residual: NDArray, learnt: NDArray) -> NDArray:
    """Return the part of a residual (m,) that repeats, zero where not ``learnt``."""
    return np.where(learnt, residual, 0.0) - _unrepeated(run, residual, learnt)


def _strongest(runs: Sequence[Run], residuals: Sequence[NDArray], above: float) -> float:
    """Return the frequency of the highest peak of the summed spectra above a limit, Hz."""
    width = runs[0].block.decimation / runs[0].motion.sample_rate_hz
    # Blocks keep their place in time, so that gaps are zeros and shift no phase.
    places = [np.round((run.time - run.time[0]) / width).astype(int) for run in runs]
    # Factor of zero padding of the spectrum in which a tone is sought.
    padding = 4
    length = padding * (max(int(p[-1]) for p in places) + 1)
    power = np.zeros(length // 2 + 1)
    for place, residual in zip(places, residuals, strict=True):
        series = np.zeros(length)
        series[place] = residual
        power += np.abs(np.fft.rfft(series)) ** 2
    frequency = np.fft.rfftfreq(length, width)
    return float(frequency[np.argmax(np.where(frequency > above, power, 0.0))])


def excesses(runs: Sequence[Run], residuals: Sequence[NDArray], floor: Floor) -> list[Excess]:
    """Return each run's residual above the noise floor, joint by joint.

    Parameters
    ----------
    runs : sequence of Run
    residuals : sequence of (m, O) arrays
        Measured less predicted torque of each run, N·m.
    floor : Floor

    Returns
    -------
    list of Excess
    """
    return [
        Excess(
            joint,
            run.motion.file,
            run.motion.run,
            float(np.sqrt(np.mean(residual[run.usable[:, j], j] ** 2))),
            float(floor.rms[j]),
        )
        for j, joint in enumerate(runs[0].motion.joints)
        for run, residual in zip(runs, residuals, strict=True)
        if run.usable[:, j].any()
    ]


HARDLY_ABOVE_NOISE = ", and it is hardly above the noise"
"""End of a sentence on a residual that is not much larger than its noise floor."""


def describe(
    machine: Machine,
    results: Sequence[Dependence],
    above: Sequence[Excess],
    surfaces: Sequence["Surface"] = (),
) -> str:
    """Describe the residual of the joint with most above its floor, in a sentence or two.

    Parameters
    ----------
    machine : Machine
    results : sequence of Dependence
    above : sequence of Excess
    surfaces : sequence of Surface, optional
        Those that predict the residual (see ``smooth_term``).
    """
    squares = {
        d.joint: np.mean([e.square for e in above if e.joint == d.joint] or [0.0]) for d in results
    }
    joint = max(squares, key=lambda name: squares[name])
    where = _where([e for e in above if e.joint == joint])
    own = [d for d in results if d.joint == joint]
    pairs = [s for s in surfaces if s.joint == joint and len(s.curve.variables) > 1]
    pair = max(pairs, key=lambda s: s.share, default=None)
    # Share from which the residual is reported to depend on a variable.
    little = 0.05
    # Two variables are reported only where they predict much more than one.
    if pair and pair.share > 1.5 * max(_rank(own[0]), little):
        words = " together with ".join(
            _words(joint, machine, variable.words) for variable in pair.curve.variables
        )
        return f"{_unexplained(joint, pair.share)} depends on {words}{where}."
    if own[0].share < little:
        subject = f"The remaining error at {the(joint)}"
        predicate = (
            "depends on nothing that was measured: no variable and no steady tone predicts"
            f" {100 * little:.0f} % of it"
        )
        if where == HARDLY_ABOVE_NOISE:  # not a place: it would part subject and predicate
            return f"{subject} {predicate}{where}."
        return f"{subject}{where}, {predicate}." if where else f"{subject} {predicate}."
    second = next(
        (d for d in own[1:] if d.variable != "phase" and d.share > max(0.5 * own[0].share, little)),
        None,
    )
    return (
        own[0].sentence + where + "." + (f" Nearly as much: {second.sentence}." if second else "")
    )


def _where(above: Sequence[Excess]) -> str:
    """Return the end of a sentence on the residual: the kind of run, or the file, that has it.

    It is ``HARDLY_ABOVE_NOISE`` where no run has a noticeable excess.
    """
    # Excess, as a share of the noise floor, below which its place is not reported.
    noticed = 0.2
    if not any(e.square > (noticed * e.floor_nm) ** 2 for e in above):
        return HARDLY_ABOVE_NOISE
    # Ratio of squared excess between kinds of run, or files, from which it is in one of them
    # only.
    one_sided = 4.0
    for what, words in (
        ("run", {"with_human": "with the human", "exo_alone": "without the human"}),
        ("file", {}),
    ):
        groups: dict[str, list[float]] = {}
        for e in above:
            groups.setdefault(getattr(e, what), []).append(e.square)
        means = sorted(((float(np.mean(v)), name) for name, v in groups.items()), reverse=True)
        if len(means) > 1 and means[0][0] > one_sided * means[1][0]:
            return (
                f", mostly {words[means[0][1]]}" if what == "run" else f", mostly in {means[0][1]}"
            )
    return ", in all validation runs alike" if len(above) > 1 else ""
