"""MATLAB, Octave and Simulink: one function file."""

import re
from collections.abc import Callable, Iterable, Mapping

from pipelines.export.equations import GROUPS, Equation, Equations, equations, holding
from pipelines.export.exported import ExportedModel
from pipelines.export.format import Format
from pipelines.export.language import Language, filled, function_name, indented, one_line

LANGUAGE = Language(
    # MATLAB has every function under its own name.
    names={},
    element=lambda name, index: f"{name}({index + 1})",
    power=lambda base, exponent: f"{base}^{exponent}",
    unequal="~=",
    branch=lambda condition, yes, no: [
        f"if {condition}",
        *indented(yes),
        *(["else", *indented(no)] if no else []),
        "end",
    ],
)


def _write(exported: ExportedModel, stem: str) -> Mapping[str, str]:
    """Return the function file."""
    model = equations(exported)
    joints = len(model.joints)
    order = [
        f"joint {i}: {joint.name}, {joint.kind}" for i, joint in enumerate(model.joints, start=1)
    ]
    keywords = """
        break case catch classdef continue else elseif end for function global if otherwise parfor
        persistent return spmd switch try while
    """
    keywords = """
        break case catch classdef continue else elseif end for function global if otherwise parfor
        persistent return spmd switch try while
    """
    places = {
        "name": function_name(stem, ".m", keywords.split()),
        "comment": _comment([*exported.heading(MATLAB), "", *order]),
        "joints": joints,
        "memories": model.memories,
        "memory_of": one_line(", ".join(dict.fromkeys(model.memory_of)) or "no effect has memory"),
        "sensor_shift": _column(model.sensor_shift),
        "link_shift": _column(model.link_shift),
        "functions": "\n\n".join(_functions(model)),
    }
    return {".m": filled("model.m", places)}


def _comment(lines: Iterable[str]) -> str:
    """Return a comment that no text in it can end."""
    return "\n".join(f"% {one_line(line)}".rstrip() for line in lines)


def _column(values: Iterable[float]) -> str:
    return "[" + "; ".join(map(repr, values)) + "]"


def _functions(model: Equations) -> Iterable[str]:
    for group in GROUPS:
        lines = _statements(model.groups[group], lambda e: LANGUAGE.added(e.outcome, "tau"))
        yield _function(f"tau = {group}(at, tau)", lines, model)
    rates = _statements(model.rates, lambda e: LANGUAGE.assigned(e.outcome, "rate", e.first))
    rates.insert(0, f"rate = zeros({model.memories}, 1);")
    yield _function("rate = memory_rate(at)", rates, model)
    readings = _statements(model.readings, lambda e: LANGUAGE.assigned(e.outcome, "tau"))
    yield _function("tau = torque_reading(at, tau)", readings, model)


def _function(head: str, lines: list[str], model: Equations) -> str:
    """Return a function with the constants that it uses."""
    # Local functions share no variables, so each defines the constants that it uses.
    known = set(re.findall(r"\w+", "\n".join(lines)))
    used = [
        f"{c.name} = {c.value!r}; {_comment([f'{c.unit}, {c.meaning}'])}"
        for c in model.used
        if c.name in known
    ]
    return "\n".join([f"function {head}", *used, *lines, "end"])


def _statements(equations: Iterable[Equation], write: Callable[[Equation], list[str]]) -> list[str]:
    """Return the statements of some equations, each with a comment."""
    return [line for e in equations for line in (_comment([f"{e.label}: {e.text}"]), *write(e))]


MATLAB = Format("matlab", "MATLAB function", ".m", holding, _write)
