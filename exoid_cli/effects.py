"""``exoid effects``: the physical effects that exoid knows."""

from typing import Annotated

import typer

from exoid_cli import completion
from exoid_cli.console import console


def effects(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="One effect, for its page.",
            show_default="a list of all",
            autocompletion=completion.effects,
        ),
    ] = None,
) -> None:
    """List the effects a model can have, or explain one with equation and parameters.

    \b
    Examples:
      exoid effects
      exoid effects stribeck_friction
    """
    from pipelines.effects import EFFECTS
    from pipelines.effects.reference import facts
    from pipelines.model import effect_named

    if name is not None:
        _page(effect_named(name))
        return
    descriptions = [facts(effect) for effect in EFFECTS]
    console.emit(descriptions)
    for effect in descriptions:
        console.say(f"{effect['effect']}, {effect['side']}, joints: {effect['joints']}")
        console.note(effect["equation"])
        console.note(f"on exoskeletons {effect['typical']}")
        console.say("")
    console.say("`exoid effects NAME` says how one looks in a plot and how to make sure of it.")


def _page(effect: type) -> None:
    from pipelines.effects.reference import facts, typical_range

    description = facts(effect)
    console.emit(description)
    console.say(f"{description['title']} ({description['effect']})")
    console.note(f"side: {description['side']}, joints: {description['joints']}")
    console.say("")
    console.note(description["meaning"])
    console.say("")
    console.note(description["equation"])
    console.say("")
    headings = ("parameter", "symbol", "unit", "meaning", "on exoskeletons")
    # At no joint, so in the units of a joint that turns.
    parameters = effect().parameters
    rows = [(p.name, p.symbol, p.unit, p.meaning, typical_range(p)) for p in parameters]
    console.table(headings, rows)
    parts = (
        ("Runs", "runs"),
        ("Looks like", "looks_like"),
        ("How the real one may differ", "forms_differ"),
        ("To confirm", "confirm"),
        ("Source", "source"),
    )
    for title, key in parts:
        text = description[key]
        if text:
            console.say(f"\n{title}")
            console.note(text if isinstance(text, str) else ", ".join(text))
