"""What a model has beside rigid body and friction: chosen by name, or named by a diagnosis.

Amplitudes, which torques are linear in, are fitted; shapes, as a stiffness or an encoder's offset, are held at what the
diagnosis found, and are as sure as it was. What each run has for itself, as an onset or a zero that is set anew, is
held whole.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipelines.contracts.joints import joints_of
from pipelines.contracts.table import Table
from pipelines.dynamics.own_values import with_own_values
from pipelines.effects import Effect
from pipelines.errors import InputError
from pipelines.label import effect_at
from pipelines.mechanics.machine import Machine
from pipelines.mechanics.run import Run
from pipelines.model import BASELINE, Model, Term, terms_beside_bodies


@dataclass(frozen=True)
class Extension:
    """Terms beside rigid body and friction."""

    terms: tuple[Term, ...] = ()
    """Of every run that they act in; their amplitudes are fitted."""
    held: tuple[Term, ...] = ()
    """Of which each run has values for itself; here those of the first."""
    shape_covariance: NDArray = field(default_factory=lambda: np.zeros((0, 0)))
    """(s, s) of the shapes of ``terms``, one after the other; nought where it is not known."""
    own: Mapping[str, tuple[Term, ...]] = field(default_factory=dict)
    """By a run's file, the held terms as that run has them; what never came there is left out."""
    each_run: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    """What ``parameters/1`` tells of the runs' own values, by the cause's label."""
    remarks: tuple[str, ...] = ()
    """Which runs' own values are not known, and which were learnt from runs to validate on, a sentence each."""

    @property
    def effects(self) -> list[Effect]:
        """All of them."""
        return [term.effect for term in (*self.terms, *self.held)]

    @property
    def shapes(self) -> NDArray:
        """Shapes of ``terms``, (s,), one after the other."""
        return np.concatenate([np.zeros(0), *(term.shape for term in self.terms)])

    def with_shapes(self, shapes: NDArray) -> "Extension":
        """Return it with other shapes of ``terms``, (s,)."""
        parts = np.split(shapes, np.cumsum([len(term.shape) for term in self.terms])[:-1])
        terms = (replace(t, values=np.append(t.linear, part)) for t, part in zip(self.terms, parts, strict=True))
        return replace(self, terms=tuple(terms))

    def checked(self, kinds: Sequence[str]) -> "Extension":
        """Return it, where all of it acts in runs of some ``kinds``.

        Raises
        ------
        InputError
            Where something acts in none.
        """
        for effect in self.effects:
            acts_in = [run for run in effect.acts_in if effect.run in (None, run)]
            if not set(acts_in) & set(kinds):
                raise InputError(
                    f"{effect.label} acts in {' or '.join(acts_in)} runs, and none to train on is given; give one, or "
                    "identify without it"
                )
        return self

    def __or__(self, other: "Extension") -> "Extension":
        """Return what is in either; of an effect in both, what this one tells."""
        have = {(effect.label, effect.run) for effect in self.effects}
        more = tuple(term for term in other.terms if (term.effect.label, term.effect.run) not in have)
        added = sum(len(term.shape) for term in more)
        return replace(
            self, terms=(*self.terms, *more), shape_covariance=np.pad(self.shape_covariance, (0, added))
        )  # fmt: skip


def chosen(labels: Iterable[str], machine: Machine) -> Extension:
    """Return the extension by the effects of some labels, ``rotor_inertia@knee``.

    Raises
    ------
    InputError
        Where there is none of this name or at this joint, or its shape would have to be known.
    """
    effects = [effect_at(label, machine, _shapeless, "identify.effects") for label in dict.fromkeys(labels)]
    return Extension() | Extension(tuple(Term(effect, np.zeros(len(effect.linear))) for effect in effects))


def _shapeless(effect: type[Effect]) -> bool:
    """Tell whether amplitudes are all that is to be known of an effect, and are the same in every run."""
    told = all(p.default is not None for p in effect.shape)
    return effect.name not in BASELINE and bool(effect.linear) and told and not any(
        p.per_run for p in (*effect.linear, *effect.shape)
    )  # fmt: skip


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
    machine = runs[0].machine
    joints = tuple(joint.name for joint in joints_of(table.metadata))
    if joints != machine.names:
        raise InputError(
            f"{table.path}: has the joints {', '.join(joints)}, the runs have {', '.join(machine.names)}; give the "
            "parameters.parquet of a diagnosis of the same machine"
        )
    told = [one for one in terms_beside_bodies(table.frame, machine) if one[0].effect.name not in BASELINE]
    shared = [one for one in told if not one[0].effect.per_run]
    held = tuple(term for term, _ in told if term.effect.per_run)
    own, remarks = {}, list[str]()
    for run, path in zip(runs, recordings, strict=True) if held else ():
        model, guesses = with_own_values(Model(held), table, path)
        own[run.file] = model.terms
        remarks += guesses
        if run.purpose == "validate" and len(guesses) < len(held):
            remarks.append(
                f"{run.file}: {' and '.join(term.effect.label for term in held)} were learnt from this run itself, so "
                "its error is not quite that of a run no fit has seen; the verdict's is"
            )
    each_run: dict[str, Any] = table.metadata.get("each_run") or {}
    labels = {term.effect.label for term in held}
    return Extension(
        terms=tuple(term for term, _ in shared),
        held=held,
        shape_covariance=_of_shapes(table, shared),
        own=own,
        each_run={label: of_runs for label, of_runs in each_run.items() if label in labels},
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _of_shapes(table: Table, terms: Sequence[tuple[Term, pd.DataFrame]]) -> NDArray:
    """Return the covariance of the shapes of some terms, (s, s), from that of the rows that tell of each."""
    told = table.metadata.get("covariance")
    error = table.frame["std_error"].to_numpy(float)
    covariance = np.nan_to_num(np.diag(error**2) if told is None else np.array(told, dtype=float))
    maps = [np.zeros((0, len(covariance)))]
    for term, rows in terms:
        effect, place = term.effect, dict(zip(rows["name"], rows.index, strict=True))
        back = np.linalg.pinv(effect.jacobian(term.values))[len(effect.linear) :]
        columns = [place.get(p.name) for p in effect.parameters]
        onto = np.zeros((len(back), len(covariance)))
        for i, row in enumerate(columns):
            if row is not None:
                onto[:, row] = back[:, i]
        maps.append(onto)
    onto = np.concatenate(maps)
    return onto @ covariance @ onto.T
