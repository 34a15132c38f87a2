"""Write the pages of docs/effects from the effects themselves.

``python -m pipelines.effects.reference docs/effects`` updates them; a test reports outdated pages.
"""

import inspect
import sys
from pathlib import Path
from typing import Any

from pipelines.effects import EFFECTS, Effect, Parameter


def facts(effect: type[Effect]) -> dict[str, Any]:
    """Return an effect's description as a dictionary, for programs."""
    return {
        "effect": effect.name,
        "title": effect.title,
        "side": effect.side.value,
        "joints": _where(effect),
        "runs": list(effect.acts_in),
        "family": effect.family.value,
        "resembles": list(effect.resembles),
        "equation": effect.equation,
        "meaning": inspect.cleandoc(effect.__doc__ or ""),
        "typical": _typical_size(effect),
        "forms_differ": effect.forms_differ,
        "looks_like": effect.looks_like,
        "confirm": effect.confirm,
        "source": effect.source,
        "parameters": [
            {
                "name": p.name,
                "symbol": p.symbol,
                "unit": p.unit,
                "meaning": p.meaning,
                "typical": list(p.typical),
                "per_run": p.per_run,
                "default": p.default,
            }
            for p in effect().parameters
        ],
    }


def _where(effect: type[Effect]) -> str:
    """Return the joints at which an effect can act, in words."""
    if effect.whole_leg:
        return "whole leg"
    if effect.joints is None:
        return "each"
    absorbed = (f"({joint}: in {into})" for joint, into in effect.absorbed.items())
    return " ".join([", ".join(effect.joints), *absorbed])


def _typical_size(effect: type[Effect]) -> str:
    """Return the typical size of an effect on an exoskeleton: the range of its first parameter."""
    first = effect().parameters[0]
    return f"{first.name} {typical_range(first)}"


def typical_range(parameter: Parameter) -> str:
    """Return the typical range of a parameter with its unit."""
    low, high = parameter.typical
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"{low:.3g} to {high:.3g}{unit}"


def _page(effect: type[Effect]) -> str:
    """Return an effect's page as Markdown."""
    stated = facts(effect)
    rows = [_row(parameter) for parameter in effect().parameters]
    laws = ", ".join(law.replace("_", " ") for law in effect.resembles) or "none"
    differs = f"**How the real one may differ:** {effect.forms_differ}."
    return "\n".join(
        [
            f"# {stated['title']}",
            "",
            (
                f"`{stated['effect']}`, side: {stated['side']}, joints: {stated['joints']}, runs:"
                f" {', '.join(stated['runs'])}"
            ),
            "",
            stated["meaning"],
            "",
            f"    {stated['equation']}",
            "",
            "| parameter | symbol | unit | meaning | on exoskeletons |",
            "|---|---|---|---|---|",
            *rows,
            "",
            f"**Looks like:** {stated['looks_like']}.",
            "",
            *([differs, ""] if effect.forms_differ else []),
            f"**Family:** {stated['family']}; **resembles** the laws: {laws}.",
            "",
            f"**To confirm it on the rig:** {stated['confirm']}.",
            "",
            f"**Source:** {stated['source']}.",
            "",
        ]
    )


def _row(parameter: Parameter) -> str:
    meaning = parameter.meaning
    if parameter.per_run:
        meaning += "; differs from run to run"
    if parameter.default is not None:
        meaning += f"; {parameter.default:g} by default"
    return (
        f"| `{parameter.name}` | {parameter.symbol} | {parameter.unit} | {meaning} |"
        f" {typical_range(parameter)} |"
    )


def pages() -> dict[str, str]:
    """Return the pages of exoid's own effects by file name, and their index."""
    # Committed pages must not depend on the packages that are installed.
    ours = [effect for effect in EFFECTS if effect.__module__.startswith("pipelines.effects.")]
    introduction = """\
# Effects

Written by `make docs` from `pipelines/effects/`; change it there. A model is a tuple of these. The
first two are the baseline of every fit; the others are the causes that `exoid diagnose` knows and a
rig file may name. `exoid effects NAME` prints a page on the terminal. The site that `make docs`
builds also shows the residual of each effect, drawn from a virtual leg that has it.
"""
    head = "| effect | side | joints | equation | on exoskeletons |\n|---|---|---|---|---|\n"
    rows = (
        f"| [{e.name}]({e.name}.md) | {e.side.value} | {_where(e)} | {e.equation} |"
        f" {_typical_size(e)} |"
        for e in ours
    )
    return {"README.md": f"{introduction}\n{head}" + "\n".join(rows) + "\n"} | {
        f"{e.name}.md": _page(e) for e in ours
    }


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages().items():
        (folder / name).write_text(text, encoding="utf-8")
