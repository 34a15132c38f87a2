"""C99: a header and a source file without dependencies, for controllers."""

from collections.abc import Callable, Iterable, Mapping

from pipelines.export.equations import GROUPS, Equation, equations, holding
from pipelines.export.exported import ExportedModel
from pipelines.export.format import Format
from pipelines.export.language import Language, filled, function_name, indented, one_line

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


def _write(exported: ExportedModel, stem: str) -> Mapping[str, str]:
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
    return {suffix: filled(f"model{suffix}", places) for suffix in (".h", ".c")}


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
