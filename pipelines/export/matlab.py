"""MATLAB, Octave and Simulink: one function file."""

import re
from collections.abc import Callable, Iterable, Mapping

from pipelines.export.equations import GROUPS, Equation, Equations, equations, holding
from pipelines.export.exported import Exported
from pipelines.export.format import Format
from pipelines.export.language import Language, function_name, indented, one_line

KEYWORDS = """
    break case catch classdef continue else elseif end for function global if otherwise parfor
    persistent return spmd switch try while
"""

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

FILE = """\
function [tau, M, C, G, rate, reading] = {name}(q, dq, ddq, t, memory)
{comment}
%
% [tau, M, C, G, rate, reading] = {name}(q, dq, ddq, t, memory)
%   q, dq, ddq  {joints} x 1: encoder angles and their rates; SI units
%   t           seconds since the start of the run; 0 by default
%   memory      {memories} x 1: {memory_of}; zeros by default
%   tau         {joints} x 1: torque that the drives must deliver
%   M, C, G     mass matrix with rotors, Coriolis matrix (dM/dt - 2 C is skew), gravity torque:
%               the rest of tau, friction and springs, is tau - M*ddq - C*dq - G
%   rate        {memories} x 1: d(memory)/dt
%   reading     {joints} x 1: reading of the torque channels at drive torque tau
if nargin < 4
    t = 0;
end
if nargin < 5
    memory = zeros({memories}, 1);
end
sensor_shift = {sensor_shift}; % encoders less motors, rad
link_shift = {link_shift}; % motors less angles from the vertical, rad
at.t = t;
at.motor = q(:) - sensor_shift;
at.q = at.motor - link_shift;
at.dq = dq(:);
at.ddq = ddq(:);
at.direction = sign(dq(:));
at.load = zeros({joints}, 1);
at.memory = memory(:);

tau = link_torque(at, link_inertia(at, zeros({joints}, 1)));
at.load = tau;
tau = drive_torque(at, drive_inertia(at, tau));
if nargout > 1
    still = at;
    still.dq = zeros({joints}, 1);
    still.ddq = zeros({joints}, 1);
    G = inertial(still);
    M = zeros({joints});
    for k = 1:{joints}
        still.ddq(k) = 1;
        M(:, k) = inertial(still) - G;
        still.ddq(k) = 0;
    end
    C = zeros({joints});
    for k = 1:{joints}
        unit = zeros({joints}, 1);
        unit(k) = 1;
        % The velocity torque is a quadratic form in dq; its polarization is the Christoffel matrix.
        C(:, k) = 0.5 * (velocity_torque(still, at.dq + unit, G) ...
            - velocity_torque(still, at.dq, G) - velocity_torque(still, unit, G));
    end
    rate = memory_rate(at);
    reading = torque_reading(at, tau);
end
end

function tau = inertial(at)
tau = drive_inertia(at, link_inertia(at, zeros({joints}, 1)));
end

function tau = velocity_torque(at, dq, G)
at.dq = dq;
tau = inertial(at) - G;
end

{functions}
"""


def _write(exported: Exported, stem: str) -> Mapping[str, str]:
    """Return the function file."""
    model = equations(exported)
    joints = len(model.joints)
    order = [
        f"joint {i}: {joint.name}, {joint.kind}" for i, joint in enumerate(model.joints, start=1)
    ]
    return {
        ".m": FILE.format(
            name=function_name(stem, ".m", KEYWORDS.split()),
            comment=_comment([*exported.heading(MATLAB), "", *order]),
            joints=joints,
            memories=model.memories,
            memory_of=one_line(", ".join(dict.fromkeys(model.memory_of)) or "no effect has memory"),
            sensor_shift=_column(model.sensor_shift),
            link_shift=_column(model.link_shift),
            functions="\n\n".join(_functions(model)),
        )
    }


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
