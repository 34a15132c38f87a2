"""Effects of a model in addition to rigid body and friction: chosen, or named by a diagnosis.

Amplitudes, in which torques are linear, are fitted, per run if they differ from run to run. Shapes,
such as a stiffness or an encoder's offset, keep the values and the uncertainty of the diagnosis.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.joints import in_words, joints_of
from pipelines.contracts.provenance import recording_behind
from pipelines.contracts.table import Table
from pipelines.effects import Effect
from pipelines.errors import InputError, about
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.run import Run
from pipelines.model import BASELINE, Term, complete_bodies, terms_next_to_bodies
from pipelines.model.per_run import guess, own_term
from pipelines.wording.label import effect_at


@dataclass(frozen=True)
class Extension:
    """Terms in addition to rigid body and friction."""

    terms: tuple[Term, ...] = ()
    """With the first run's values of parameters that differ from run to run."""
    shape_covariance: NDArray | None = None
    """(s, s) of the terms' shapes, in their order; None if they are assumed exact."""
    critical: float = 1.96
    """Half-width of a shape's 95 % interval in standard errors."""
    own: Mapping[str, tuple[Term | None, ...]] = field(default_factory=dict)
    """Terms by the file of a run; None for an effect that does not occur in it."""
    bodies: Mapping[str, NDArray] = field(default_factory=dict)
    """Rigid bodies (k,) of the diagnosis, by kind of run and ``human``; may be empty."""
    recordings: Mapping[str, str] = field(default_factory=dict)
    """Hash of its recording, by the file of a run."""
    remarks: tuple[str, ...] = ()
    """A sentence for each effect left out, value guessed, or value from a validation run."""

    @property
    def covariance(self) -> NDArray:
        """Covariance of the shapes, (s, s)."""
        s = sum(len(term.shape) for term in self.terms)
        return np.zeros((s, s)) if self.shape_covariance is None else self.shape_covariance

    def with_terms(self, terms: Iterable[Term]) -> "Extension":
        """Return it with more terms; a remark names terms that it has already."""
        existing = {(term.effect.label, term.effect.run) for term in self.terms}
        more, remarks = [], list(self.remarks)
        for term in terms:
            if (term.effect.label, term.effect.run) in existing:
                remarks.append(
                    f"{term.effect.label} is one of the causes already, and is fitted as such"
                )
            else:
                more.append(term)
        added = sum(len(term.shape) for term in more)
        # Chosen effects are the same in every run, so each run's own terms get them unchanged.
        own = {file: (*own, *more) for file, own in self.own.items()}
        return replace(
            self,
            terms=(*self.terms, *more),
            # Shapes of the added effects are defaults and no estimates, so they count as exact.
            shape_covariance=np.pad(self.covariance, (0, added)),
            own=own,
            remarks=tuple(remarks),
        )


def chosen(labels: Iterable[str], machine: Machine, runs: Sequence[Run] = ()) -> tuple[Term, ...]:
    """Return the effects of some labels, ``rotor_inertia@knee``, without amplitudes.

    Parameters
    ----------
    labels : iterable of str
        Labels.
    machine : Machine
        The machine of the runs.
    runs : sequence of Run, optional
        Runs whose training positions have the ends at which some shapes are held.

    Raises
    ------
    InputError
        If there is no such effect at such a joint, or its shape is unknown.
    """
    reason = (
        "others have shapes from a diagnosis (--causes), or cannot be separated from rigid body and"
        " friction"
    )
    unique = dict.fromkeys(labels)
    effects = [effect_at(label, machine, _has_no_shape, "--effect", reason) for label in unique]
    return tuple(Term(effect, _without_amplitudes(effect, runs)) for effect in effects)


def _without_amplitudes(effect: Effect, runs: Sequence[Run]) -> NDArray:
    """Return an effect's values: amplitudes are zero, shapes at their defaults or at an end."""
    values = effect.completed(np.zeros(len(effect.linear)))
    ends = [
        (i, parameter.swept_end) for i, parameter in enumerate(effect.fitted) if parameter.swept_end
    ]
    train = [run for run in runs if run.purpose == "train" and effect.acts(run.run)]
    if not ends or not train:
        return values
    motions = [piece.motion for run in train for piece in run.pieces(0)]
    angles = [m.q[m.valid, effect.column(m)] for m in motions if m.valid.any()]
    low, high = min(float(q.min()) for q in angles), max(float(q.max()) for q in angles)
    for i, end in ends:
        values[i] = low if end < 0 else high
    return values


def refuse_unread(terms: Iterable[Term], runs: Sequence[Run]) -> None:
    """Refuse runs without a temperature on which an effect depends.

    Raises
    ------
    InputError
        With the effect, the run and the column.
    """
    for effect in (term.effect for term in terms if term.effect.needs_temperature):
        for run in (run for run in runs if effect.acts(run.run)):
            # A column is in all of a file or in none, so one piece decides.
            first = next(iter(run.pieces(0))).motion
            if effect.explains(first):
                continue
            raise InputError(
                f"{run.file}: has no column {effect.joint}_temperature_c, on which {effect.label}"
                " depends. Record the temperature, or leave the effect out"
            )


def _has_no_shape(effect: type[Effect]) -> bool:
    """Return whether only amplitudes of an effect are unknown, and are the same in every run."""
    has_defaults = all(p.default is not None for p in effect.shape)
    is_same = not any(p.per_run for p in (*effect.linear, *effect.shape))
    return effect.name not in BASELINE and bool(effect.linear) and has_defaults and is_same


def named(table: Table, runs: Sequence[Run], recordings: Sequence[Path]) -> Extension:
    """Return the extension with the causes of a diagnosis, from its ``parameters/1`` table.

    Parameters
    ----------
    table : Table
        ``parameters.parquet`` of ``exoid diagnose``.
    runs : sequence of Run
        Runs to train on and to validate on.
    recordings : sequence of Path
        The file of each run.

    Raises
    ------
    InputError
        If the table is of another machine.
    """
    _refuse_another_machine(table, runs[0])
    kinds = {run.run for run in runs if run.purpose == "train"}
    with about(table.path):
        others = terms_next_to_bodies(table.frame, runs[0].machine)
    causes = [one for one in others if one[0].effect.name not in BASELINE]
    absent = [term for term, _ in causes if not any(term.effect.acts(kind) for kind in kinds)]
    # Compared by identity, because terms hold arrays, which have no truth value when compared.
    acting = [(term, rows) for term, rows in causes if all(term is not one for one in absent)]
    remarks = [
        f"{term.effect.label} is left out: it acts in none of these training runs"
        for term in absent
    ]
    terms = tuple(term for term, _ in acting)
    own, hashes = {}, {}
    # A run may have another name than in the diagnosis, so the hash of its recording identifies it.
    if any(term.effect.per_run for term in terms):
        for run, path in zip(runs, recordings, strict=True):
            sha256 = recording_behind(path)
            hashes[run.file] = sha256
            with about(table.path):
                own[run.file] = tuple(own_term(term, table, sha256) for term in terms)
            in_run = [term for term in terms if term.effect.acts(run.run)]
            remarks += _remarks(run, path, in_run, table, sha256)
    shapes, unique = _of_shapes(table, acting), tuple(dict.fromkeys(remarks))
    return Extension(
        terms, shapes, _critical(table), own, _bodies(table, runs[0].machine), hashes, unique
    )


def _refuse_another_machine(table: Table, run: Run) -> None:
    mechanism = table.metadata.get("mechanism") or run.machine.mechanism.name
    joints = joints_of(table.metadata) if table.metadata.get("joints") else run.machine.joints
    of_table, of_runs = in_words(joints), in_words(run.machine.joints)
    remedy = "give the parameters.parquet of a diagnosis of the same machine"
    if of_table != of_runs or mechanism != run.machine.mechanism.name:
        raise InputError(
            f"{table.path}: is of a {mechanism} with the joints {of_table}, the runs are of a"
            f" {run.machine.mechanism.name} with {of_runs}; {remedy}"
        )
    # Inertial parameters contain the lengths: with another thigh they describe another leg.
    geometry = table.metadata.get("geometry") or {}
    for name, length in run.machine.metadata(run.geometry).items():
        if not np.isclose(geometry.get(name, length), length):
            raise InputError(
                f"{table.path}: has {name} {geometry[name]:g}, the runs have {length:g}; {remedy}"
            )


def _remarks(run: Run, path: Path, terms: Sequence[Term], table: Table, sha256: str) -> list[str]:
    """Return a sentence on each guessed value, and on values fitted to a validation run."""
    remarks, fitted = [], []
    for term in terms:
        if term.effect.per_run:
            remark = guess(term, table, sha256, path)
            if remark:
                remarks.append(remark)
            else:
                fitted.append(term.effect.label)
    if fitted and run.purpose == "validate":
        remarks.append(
            f"{run.file}: its values of {' and '.join(fitted)} were fitted to this run, so its"
            " error is slightly too small. The verdict's error is not"
        )
    return remarks


def _of_shapes(table: Table, terms: Sequence[tuple[Term, pd.DataFrame]]) -> NDArray:
    """Return the covariance of the terms' shapes, (s, s), from that of their rows."""
    stated = table.metadata.get("covariance")
    error = table.frame["std_error"].to_numpy(float)
    whole = np.diag(error**2) if stated is None else np.array(stated, dtype=float)
    # NaN marks a held value whose error is unknown; it counts as exact.
    covariance = np.nan_to_num(whole)
    maps = [np.zeros((0, len(covariance)))]
    for term, rows in terms:
        effect, place = term.effect, dict(zip(rows["name"], rows.index, strict=True))
        # The table has physical values; the pseudoinverse leads back to fitted ones, whose shapes
        # are last.
        back = np.linalg.pinv(effect.jacobian(term.values))[len(effect.linear) :]
        onto = np.zeros((len(back), len(covariance)))
        for i, parameter in enumerate(effect.parameters):
            if parameter.name in place:
                onto[:, place[parameter.name]] = back[:, i]
        maps.append(onto)
    onto = np.concatenate(maps)
    return onto @ covariance @ onto.T


def _critical(table: Table) -> float:
    """Return the half-width of the table's intervals in standard errors."""
    frame = table.frame
    # The upper half only: the lower one may end at zero.
    widths = (frame["ci95_high"] - frame["value"]) / frame["std_error"]
    width = widths.replace([np.inf, 0.0], np.nan).median()
    return float(width) if np.isfinite(width) else 1.96


def _bodies(table: Table, machine: Machine) -> dict[str, NDArray]:
    """Return the rigid bodies of a table, without those that it does not know completely."""
    bodies = complete_bodies(table.frame, machine)
    return {kind: rows["value"].to_numpy(float) for kind, rows in bodies.items()}
