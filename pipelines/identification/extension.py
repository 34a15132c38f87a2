"""What a model has beside rigid body and friction: chosen by name, or named by a diagnosis.

Amplitudes, which torques are linear in, are fitted, in each run where each run has its own. Shapes,
as a stiffness or an encoder's offset, are held at what the diagnosis found, and are as sure as it
was.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.provenance import recording_behind
from pipelines.contracts.table import Table
from pipelines.effects import RUNS, Effect
from pipelines.effects.rigid_body import RigidBody
from pipelines.errors import InputError, about
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.run import Run
from pipelines.model import BASELINE, Term, terms_next_to_bodies
from pipelines.model.per_run import guess, own_term
from pipelines.wording.label import effect_at

WHY = (
    "others have shapes that a diagnosis finds (--causes), or cannot be told from rigid body and"
    " friction"
)


@dataclass(frozen=True)
class Extension:
    """Terms beside rigid body and friction."""

    terms: tuple[Term, ...] = ()
    """Of what each run has for itself, as the first run has it."""
    shape_covariance: NDArray | None = None
    """(s, s) of the terms' shapes, one after the other; None where they are taken for certain."""
    critical: float = 1.96
    """Half-width of a shape's 95 % interval in standard errors."""
    own: Mapping[str, tuple[Term | None, ...]] = field(default_factory=dict)
    """By a run's file, the terms as they are there; None of what never came."""
    bodies: Mapping[str, NDArray] = field(default_factory=dict)
    """By kind of run, and ``human``: the rigid bodies, (k,), that a diagnosis found beside them;
    empty without one."""
    recordings: Mapping[str, str] = field(default_factory=dict)
    """By a run's file, the hash of its recording."""
    remarks: tuple[str, ...] = ()
    """What was left out or guessed, and what was learnt from runs to validate on, a sentence
    each."""

    @property
    def covariance(self) -> NDArray:
        """Covariance of the shapes, (s, s)."""
        s = sum(len(term.shape) for term in self.terms)
        return np.zeros((s, s)) if self.shape_covariance is None else self.shape_covariance

    def with_terms(self, terms: Iterable[Term]) -> "Extension":
        """Return it with more terms; those that it has already are left out, and that is told."""
        have = {(term.effect.label, term.effect.run) for term in self.terms}
        more, remarks = [], list(self.remarks)
        for term in terms:
            if (term.effect.label, term.effect.run) in have:
                remarks.append(
                    f"{term.effect.label} is among the causes already, and is fitted as it is there"
                )
            else:
                more.append(term)
        added = sum(len(term.shape) for term in more)
        own = {file: (*own, *more) for file, own in self.own.items()}
        return replace(
            self,
            terms=(*self.terms, *more),
            shape_covariance=np.pad(self.covariance, (0, added)),
            own=own,
            remarks=tuple(remarks),
        )


def chosen(labels: Iterable[str], machine: Machine) -> tuple[Term, ...]:
    """Return the effects of some labels, ``rotor_inertia@knee``, without amplitudes.

    Raises
    ------
    InputError
        Where there is none of this name or at this joint, or its shape would have to be known.
    """
    effects = [
        effect_at(label, machine, _shapeless, "--effect", WHY) for label in dict.fromkeys(labels)
    ]
    return tuple(Term(effect, np.zeros(len(effect.linear))) for effect in effects)


def refuse_unread(terms: Iterable[Term], runs: Sequence[Run]) -> None:
    """Refuse runs that lack a temperature that an effect depends on.

    Raises
    ------
    InputError
        Names the effect, the run and the column.
    """
    for effect in (term.effect for term in terms if term.effect.needs_temperature):
        for run in (run for run in runs if effect.acts(run.run)):
            first = next(iter(run.pieces(0))).motion
            if effect.explains(first):
                continue
            column = f"{effect.joint}_temperature_c"
            raise InputError(
                f"{run.file}: holds no {column}, on which {effect.label} depends; "
                "record the temperature, or leave the effect out"
            )


def _shapeless(effect: type[Effect]) -> bool:
    """Tell whether amplitudes are all that is to be known of an effect, and are the same in every
    run."""
    has_defaults = all(p.default is not None for p in effect.shape)
    alike = not any(p.per_run for p in (*effect.linear, *effect.shape))
    return effect.name not in BASELINE and bool(effect.linear) and has_defaults and alike


def named(table: Table, runs: Sequence[Run], recordings: Sequence[Path]) -> Extension:
    """Return the extension by what a diagnosis named and wrote as a ``parameters/1`` table.

    Parameters
    ----------
    table : Table
        ``parameters.parquet`` of ``exoid diagnose``.
    runs : sequence of Run
        That are to be fitted and judged.
    recordings : sequence of Path
        Where each of them is.

    Raises
    ------
    InputError
        Where the table is of another machine.
    """
    _refuse_another_machine(table, runs[0])
    kinds = {run.run for run in runs if run.purpose == "train"}
    with about(table.path):
        others = terms_next_to_bodies(table.frame, runs[0].machine)
    causes = [one for one in others if one[0].effect.name not in BASELINE]
    acting = [one for one in causes if any(one[0].effect.acts(kind) for kind in kinds)]
    remarks = [
        f"{term.effect.label} is left out: it acts in none of these runs to train on"
        for term, _ in causes
        if all(term is not other for other, _ in acting)
    ]
    terms = tuple(term for term, _ in acting)
    own, hashes = {}, {}
    for run, path in (
        zip(runs, recordings, strict=True) if any(term.effect.per_run for term in terms) else ()
    ):
        this = hashes[run.file] = recording_behind(path)
        with about(table.path):
            own[run.file] = tuple(own_term(term, table, this) for term in terms)
        remarks += _about(
            run, path, [term for term in terms if term.effect.acts(run.run)], table, this
        )
    return Extension(
        terms,
        _of_shapes(table, acting),
        _critical(table),
        own,
        _bodies(table),
        hashes,
        tuple(dict.fromkeys(remarks)),
    )


def _refuse_another_machine(table: Table, run: Run) -> None:
    mechanism = table.metadata.get("mechanism") or run.machine.mechanism.name
    theirs = [
        *(
            f"{one['name']} ({one['kind']})"
            for one in table.metadata.get("joints") or run.joint_metadata
        )
    ]
    ours = [f"{one['name']} ({one['kind']})" for one in run.joint_metadata]
    remedy = "give the parameters.parquet of a diagnosis of the same machine"
    if theirs != ours or mechanism != run.machine.mechanism.name:
        raise InputError(
            f"{table.path}: is of a {mechanism} with the joints {', '.join(theirs)}, the runs are"
            f" of a {run.machine.mechanism.name} with {', '.join(ours)}; {remedy}"
        )
    geometry = table.metadata.get("geometry") or {}
    for name, length in run.machine.metadata(run.geometry).items():
        if not np.isclose(geometry.get(name, length), length):
            raise InputError(
                f"{table.path}: has {name} {geometry[name]:g}, the runs have {length:g}; {remedy}"
            )


def _about(run: Run, path: Path, terms: Sequence[Term], table: Table, sha256: str) -> list[str]:
    """Say what is guessed of a run's own values, and what was learnt from a run that is to
    judge."""
    own = [term for term in terms if term.effect.per_run]
    guesses = [guess(term, table, sha256, path) for term in own]
    learnt = [term.effect.label for term, guessed in zip(own, guesses, strict=True) if not guessed]
    sentences = [guessed for guessed in guesses if guessed]
    if learnt and run.purpose == "validate":
        sentences.append(
            f"{run.file}: what it has for itself of {' and '.join(learnt)} was learnt from this"
            " run, so its error is not quite that of a run no fit has seen; the verdict's is"
        )
    return sentences


def _of_shapes(table: Table, terms: Sequence[tuple[Term, pd.DataFrame]]) -> NDArray:
    """Return the covariance of the shapes of some terms, (s, s), from that of the rows that tell of
    each."""
    stated = table.metadata.get("covariance")
    error = table.frame["std_error"].to_numpy(float)
    covariance = np.nan_to_num(
        np.diag(error**2) if stated is None else np.array(stated, dtype=float)
    )
    maps = [np.zeros((0, len(covariance)))]
    for term, rows in terms:
        effect, place = term.effect, dict(zip(rows["name"], rows.index, strict=True))
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
    width = (
        ((frame["ci95_high"] - frame["value"]) / frame["std_error"])
        .replace([np.inf, 0.0], np.nan)
        .median()
    )
    return float(width) if np.isfinite(width) else 1.96


def _bodies(table: Table) -> dict[str, NDArray]:
    frame = table.frame[table.frame["effect"] == RigidBody.name]
    return {
        kind: frame.loc[frame["run"] == kind, "value"].to_numpy(float)
        for kind in (*RUNS, "human")
        if (frame["run"] == kind).any()
    }
