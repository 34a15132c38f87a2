"""Build models from ``parameters/1`` tables, and check that their rigid bodies are realizable."""

from typing import TYPE_CHECKING

from pipelines.contracts.joint_units import FIRST_MOMENT
from pipelines.effects import RUNS, Effect
from pipelines.effects.baseline import RigidBody
from pipelines.errors import InputError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.machine import THE_LEG, Machine
from pipelines.model.model import Model, Term, effect_named, term_from

if TYPE_CHECKING:
    import pandas as pd


def model_from_parameters(frame: "pd.DataFrame", run: str, machine: Machine = THE_LEG) -> Model:
    """Build the model of one kind of run from a ``parameters/1`` table.

    Parameters
    ----------
    frame : DataFrame
        Rows of the table.
    run : str
        A kind of run, or ``human`` for the wearer's own rigid body.
    machine : Machine
        The machine that the table describes.

    Raises
    ------
    InputError
        If the table has no rigid body for that kind of run.
    """
    is_body = frame["effect"] == RigidBody.name
    if not (is_body & (frame["run"] == run)).any():
        known = ", ".join(sorted(frame.loc[is_body, "run"].dropna().unique())) or "none"
        raise InputError(
            f"the parameters hold no rigid body for run {run!r}, only for {known}. Choose one of"
            " these, or identify with a training run of that kind"
        )
    terms = [
        term for term, _ in terms_next_to_bodies(frame, machine) if term.effect.run in (None, run)
    ]
    bodies = {str(kind): rows for kind, rows in frame[is_body].groupby("run")}
    if any(term.effect.at_cuff for term in terms) and {"exo_alone", "human"} <= set(bodies):
        # Machine and limb move separately, so each needs its own body.
        parts = [
            (RigidBody(on=machine), bodies["exo_alone"]),
            (RigidBody(run="with_human", on=machine), bodies["human"]),
        ]
    else:
        # ``human`` names a body and is no kind of run.
        parts = [(RigidBody(run=run if run in RUNS else None, on=machine), bodies[run])]
    return Model((*(_term_from_rows(effect, rows) for effect, rows in parts), *terms))


def terms_next_to_bodies(
    frame: "pd.DataFrame", machine: Machine
) -> "list[tuple[Term, pd.DataFrame]]":
    """Return every term of a ``parameters/1`` table except rigid bodies, with its rows.

    Raises
    ------
    InputError
        If an effect or a joint is unknown, or if values are missing or occur twice.
    """
    rest = frame[frame["effect"] != RigidBody.name]
    twice = rest[["effect", "joint", "run", "name"]].duplicated()
    # Values become a dictionary later, in which the last of two would count silently.
    if twice.any():
        row = rest[twice].iloc[0]
        raise InputError(
            f"the parameters table: row {row.name} repeats {row['name']} of {row['effect']},"
            " expected every value once; delete one of the two rows"
        )
    # Effects of the whole machine have no joint, and ``dropna`` would drop them.
    others = rest.groupby(["effect", "joint", "run"], sort=False, dropna=False)
    return [(_term_from_rows(_effect_of_rows(rows, machine), rows), rows) for _, rows in others]


def _effect_of_rows(rows: "pd.DataFrame", machine: Machine) -> Effect:
    """Return the effect that some rows of a parameters table describe."""
    # A missing joint or run may be None or NaN; only a text is a name.
    first = rows.iloc[0]
    joint, run = (first[key] if isinstance(first[key], str) else None for key in ("joint", "run"))
    of = effect_named(str(first["effect"]))
    if joint not in ([None] if of.whole_leg else machine.names):
        expected = "none: it is the whole machine's" if of.whole_leg else " or ".join(machine.names)
        raise InputError(
            f"the parameters table: {of.name} has the joint {joint or 'none'}, expected {expected};"
            " correct its column joint, or the joints in its metadata"
        )
    each_run = bool(of.may_differ and "each_run" in rows and rows["each_run"].any())
    return of(joint=joint, run=run, on=machine, each_run=each_run)


def _term_from_rows(effect: Effect, rows: "pd.DataFrame") -> Term:
    try:
        return term_from(effect, dict(zip(rows["name"], rows["value"].astype(float), strict=True)))
    except InputError as error:
        raise InputError(f"the parameters table: {error}") from None


def complete_bodies(parameters: "pd.DataFrame", machine: Machine) -> "dict[str, pd.DataFrame]":
    """Return the rows of each rigid body by its kind of run, of those with every parameter.

    A table lacks parameters that no measured torque determines. The rest of such a body can neither
    be judged nor simulated.

    Parameters
    ----------
    parameters : DataFrame
        Rows of a ``parameters/1`` table.
    machine : Machine
        Its mechanism has the bodies.
    """
    bodies = parameters[parameters["effect"] == RigidBody.name]
    number = len(machine.mechanism.parameters)
    by_run = bodies.groupby("run", sort=False)
    return {str(run): rows for run, rows in by_run if len(rows) == number}


def unrealizable(parameters: "pd.DataFrame", machine: Machine, geometry: Geometry) -> list[str]:
    """Explain why no real machine has the rigid bodies of a ``parameters/1`` table.

    Parameters
    ----------
    parameters : DataFrame
        Rows of the table.
    machine : Machine
        Its mechanism has the bodies.
    geometry : Geometry
        Lengths, m.

    Returns
    -------
    list of str
        A reason for each kind of run that is affected; empty if all bodies are realizable.
    """
    return [
        f"{run}: {reason}"
        for run, rows in complete_bodies(parameters, machine).items()
        for reason in machine.mechanism.unrealizable(rows["value"].to_numpy(float), geometry)
    ]


def upside_down(parameters: "pd.DataFrame", machine: Machine) -> list[str]:
    """Report first moments of mass that lie above their axes.

    Angles count from hanging straight down. A link may be overbalanced, or stand up. Otherwise its
    zero or a sign is wrong, or a spring is mistaken for gravity.

    Parameters
    ----------
    parameters : DataFrame
        Rows of a ``parameters/1`` table.
    machine : Machine
        Its mechanism has the moments.

    Returns
    -------
    list of str
        A sentence for each moment; empty if gravity does not act on the mechanism.
    """
    if not machine.mechanism.has_gravity:
        return []
    moments = {
        parameter.name
        for parameter in machine.mechanism.parameters
        if parameter.unit == FIRST_MOMENT
    }
    of_bodies = parameters[
        (parameters["effect"] == RigidBody.name) & parameters["name"].isin(moments)
    ]
    return [
        f"{row['run']}: {row['name']} = {row['value']:.3g} kg·m ({row['ci95_low']:.3g} to"
        f" {row['ci95_high']:.3g}) puts mass above the axis at angle zero, where the link is to"
        " hang straight down. Unless the link is overbalanced or stands up, the zero is half a"
        " turn off, a sign is wrong, or a spring is taken for gravity"
        # The whole interval has to be negative, as noise may change the sign of a small moment.
        for row in of_bodies[of_bodies["ci95_high"] < 0.0].to_dict("records")
    ]
