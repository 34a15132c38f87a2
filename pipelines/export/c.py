"""C99: a header and a source file without dependencies, for controllers."""

from collections.abc import Callable, Iterable, Mapping

from pipelines.export.equations import GROUPS, Equation, equations, holding
from pipelines.export.exported import Exported
from pipelines.export.format import Format
from pipelines.export.language import Language, function_name, indented, one_line

LANGUAGE = Language(
    names={"abs": "fabs", "max": "fmax", "min": "fmin", "at.t": "at->t"},
    element=lambda name, index: f"{name.replace('.', '->')}[{index}]",
    power=lambda base, exponent: f"pow({base}, {exponent})",
    unequal="!=",
    branch=lambda condition, yes, no: [
        f"if ({condition}) {{",
        *indented(yes),
        *(["} else {", *indented(no)] if no else []),
        "}",
    ],
)

HEADER = """\
{comment}
#ifndef {GUARD}
#define {GUARD}

#ifdef __cplusplus
extern "C" {{
#endif

#define {NAME}_JOINTS {joints}
#define {NAME}_MEMORY {room} {memory_comment}

/* Torque that the drives must deliver. t: seconds since the start of the run; q, dq, ddq: encoder
 * angles and their rates, SI units; memory: {NAME}_MEMORY numbers, initially 0.
 * Load-dependent friction makes it nonlinear in ddq. */
void {name}_inverse_dynamics(double t, const double q[{joints}], const double dq[{joints}],
                             const double ddq[{joints}], const double memory[{room}],
                             double tau[{joints}]);

/* The same at ddq = 0: Coriolis and centrifugal torque, gravity, friction, springs. */
void {name}_bias(double t, const double q[{joints}], const double dq[{joints}],
                 const double memory[{room}], double tau[{joints}]);

/* Mass matrix with rotors. */
void {name}_mass_matrix(double t, const double q[{joints}], double M[{joints}][{joints}]);

/* Rate of the memory, to be integrated by the caller. */
void {name}_memory_rate(double t, const double q[{joints}], const double dq[{joints}],
                        const double memory[{room}], double rate[{room}]);

/* Reading of the torque channels at drive torque tau; in place. */
void {name}_torque_reading(double t, double tau[{joints}]);

#ifdef __cplusplus
}}
#endif
#endif
"""

SOURCE = """\
{comment}
#include "{name}.h"

#include <math.h>

{constants}

static const double sensor_shift[{joints}] = {sensor_shift}; /* encoders less motors, rad */
/* Motors less angles from the vertical, rad. */
static const double link_shift[{joints}] = {link_shift};

struct instant {{
    double t;
    double q[{joints}], motor[{joints}], dq[{joints}], ddq[{joints}];
    double direction[{joints}], load[{joints}];
    double memory[{room}];
}};

static double sign(double x) {{ return (x > 0.0) - (x < 0.0); }}

static struct instant instant_of(double t, const double *q, const double *dq, const double *ddq,
                                 const double *memory) {{
    struct instant at;
    at.t = t;
    for (int j = 0; j < {joints}; j++) {{
        at.motor[j] = q[j] - sensor_shift[j];
        at.q[j] = at.motor[j] - link_shift[j];
        at.dq[j] = dq[j];
        at.ddq[j] = ddq[j];
        at.direction[j] = sign(dq[j]);
        at.load[j] = 0.0;
    }}
    for (int i = 0; i < {room}; i++) {{
        at.memory[i] = memory[i];
    }}
    return at;
}}

{groups}

void {name}_inverse_dynamics(double t, const double q[{joints}], const double dq[{joints}],
                             const double ddq[{joints}], const double memory[{room}],
                             double tau[{joints}]) {{
    struct instant at = instant_of(t, q, dq, ddq, memory);
    for (int j = 0; j < {joints}; j++) {{
        tau[j] = 0.0;
    }}
    link_inertia(&at, tau);
    link_torque(&at, tau);
    for (int j = 0; j < {joints}; j++) {{
        at.load[j] = tau[j];
    }}
    drive_inertia(&at, tau);
    drive_torque(&at, tau);
}}

void {name}_bias(double t, const double q[{joints}], const double dq[{joints}],
                 const double memory[{room}], double tau[{joints}]) {{
    const double still[{joints}] = {{0.0}};
    {name}_inverse_dynamics(t, q, dq, still, memory, tau);
}}

void {name}_mass_matrix(double t, const double q[{joints}], double M[{joints}][{joints}]) {{
    const double still[{joints}] = {{0.0}}, no_memory[{room}] = {{0.0}};
    struct instant at = instant_of(t, q, still, still, no_memory);
    double at_rest[{joints}] = {{0.0}};
    link_inertia(&at, at_rest);
    drive_inertia(&at, at_rest);
    for (int k = 0; k < {joints}; k++) {{
        double column[{joints}] = {{0.0}};
        at.ddq[k] = 1.0;
        link_inertia(&at, column);
        drive_inertia(&at, column);
        at.ddq[k] = 0.0;
        for (int j = 0; j < {joints}; j++) {{
            M[j][k] = column[j] - at_rest[j];
        }}
    }}
}}

void {name}_memory_rate(double t, const double q[{joints}], const double dq[{joints}],
                        const double memory[{room}], double rate[{room}]) {{
    const double still[{joints}] = {{0.0}};
    struct instant now = instant_of(t, q, dq, still, memory), *at = &now;
    (void)at;
    for (int i = 0; i < {room}; i++) {{
        rate[i] = 0.0;
    }}
{rates}}}

void {name}_torque_reading(double t, double tau[{joints}]) {{
    struct instant now = {{.t = t}}, *at = &now;
    (void)at;
    (void)tau;
{readings}}}
"""


def _write(exported: Exported, stem: str) -> Mapping[str, str]:
    """Return header and source; their functions start with the file's name."""
    model, name = equations(exported), function_name(stem, ".c")
    joints = len(model.joints)
    order = [f"joint {i}: {joint.name}, {joint.kind}" for i, joint in enumerate(model.joints)]
    of_memory = ", ".join(dict.fromkeys(model.memory_of))
    places = {
        "comment": _comment([*exported.heading(C), "", *order]),
        "name": name,
        "NAME": name.upper(),
        "GUARD": f"{name.upper()}_H",
        "joints": joints,
        # C has no arrays of length zero.
        "room": max(1, model.memories),
        "memory_comment": _comment(
            [f"memory of {of_memory}" if of_memory else "no effect has memory; pass any number"]
        ),
        "constants": "\n".join(
            f"static const double {c.name} = {c.value!r}; {_comment([f'{c.unit}, {c.meaning}'])}"
            for c in model.used
        ),
        "sensor_shift": _array(model.sensor_shift),
        "link_shift": _array(model.link_shift),
        "groups": "\n\n".join(_group(group, model.groups[group]) for group in GROUPS),
        "rates": _lines(model.rates, lambda e: LANGUAGE.assigned(e.outcome, "rate", e.first)),
        "readings": _lines(model.readings, lambda e: LANGUAGE.assigned(e.outcome, "tau")),
    }
    return {".h": HEADER.format(**places), ".c": SOURCE.format(**places)}


def _comment(lines: Iterable[str]) -> str:
    """Return a comment that no text in it can end."""
    safe = [one_line(line).replace("*/", "* /").replace("/*", "/ *") for line in lines]
    return "/* " + "\n".join(safe).replace("\n", "\n * ").replace(" \n", "\n") + " */"


def _array(values: Iterable[float]) -> str:
    return "{" + ", ".join(map(repr, values)) + "}"


def _group(name: str, group: list[Equation]) -> str:
    lines = _lines(group, lambda e: LANGUAGE.added(e.outcome, "tau"))
    # Compilers warn of arguments that are not used.
    unused = "" if group else "    (void)at;\n    (void)tau;\n"
    return f"static void {name}(const struct instant *at, double *tau) {{\n{unused}{lines}}}"


def _lines(equations: Iterable[Equation], write: Callable[[Equation], list[str]]) -> str:
    """Return the indented statements of some equations, each with a comment."""
    lines = [line for e in equations for line in (_comment([f"{e.label}: {e.text}"]), *write(e))]
    return "".join(f"{line}\n" for line in indented(lines))


C = Format("c", "C99 source", ".c", holding, _write)
