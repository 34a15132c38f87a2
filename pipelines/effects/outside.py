"""Load effects of other packages: entry points of the group ``exoid.effects``.

A package names its class in its own pyproject.toml::

    [project.entry-points."exoid.effects"]
    tendon_slack = "their_package.tendon_slack:TendonSlack"
"""

import inspect
from collections.abc import Iterable
from importlib.metadata import EntryPoint, entry_points

from pipelines.effects.effect import Effect
from pipelines.errors import InputError

STATED = ("name", "title", "side", "equation", "source", "looks_like", "confirm")
"""Attributes that every effect must have."""


def effects_of_other_packages(known: Iterable[type[Effect]]) -> tuple[type[Effect], ...]:
    """Load the effects of all installed packages, in the order of their names.

    Raises
    ------
    InputError
        If one cannot be loaded, is not an effect, or has the name of another.
    """
    taken = {effect.name: effect.__module__ for effect in known}
    effects = []
    # Sorted, because the order of installed packages differs between computers.
    for entry in sorted(entry_points(group="exoid.effects"), key=lambda entry: entry.name):
        effect = _loaded(entry)
        if effect.name in taken:
            reason = f"its name {effect.name} is already used by {taken[effect.name]}"
            raise _broken(entry, reason, "rename it")
        taken[effect.name] = effect.__module__
        effects.append(effect)
    return tuple(effects)


def _loaded(entry: EntryPoint) -> type[Effect]:
    try:
        effect = entry.load()
    # The code of another package may raise anything when it is imported.
    except Exception as error:
        reason = f"loading it failed: {type(error).__name__}: {error}"
        raise _broken(entry, reason, "correct it") from error
    if not (inspect.isclass(effect) and issubclass(effect, Effect)):
        reason = f"it is {effect!r}, expected a subclass of pipelines.effects.Effect"
        raise _broken(entry, reason, "correct it")
    silent = [name for name in STATED if not hasattr(effect, name)]
    if silent:
        reason = f"{effect.__name__} does not state {', '.join(silent)}"
        raise _broken(entry, reason, "add what is missing")
    return effect


def _broken(entry: EntryPoint, reason: str, remedy: str) -> InputError:
    package = entry.dist.name if entry.dist else "an unknown package"
    return InputError(
        f"effect {entry.name} ({entry.value}) of package {package} cannot be used: {reason};"
        f" {remedy}, or uninstall {package}"
    )
