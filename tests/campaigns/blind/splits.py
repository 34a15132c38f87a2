"""Which forms are kept from learning in which fold, by their names alone.

Every form of an effect is in one of ``folds`` folds; whoever learns for a fold sees none of its
forms, and is judged on them. Kinds that are held back are in no fold: learning never sees them.
"""

import hashlib
from collections.abc import Mapping
from typing import Any

from tests.campaigns.blind import further_forms  # noqa: F401 - adds to the forms
from tests.campaigns.blind.causes import FORMS
from tests.campaigns.blind.outside import KINDS

FOLDS = 3


def forms_by_fold(folds: int = FOLDS) -> list[set[tuple[str, str]]]:
    """Return effect and form of all that each fold keeps from learning.

    Parameters
    ----------
    folds : int
        How many. An effect's forms are spread over as many of them as it has forms.

    Returns
    -------
    list of sets of (effect, form)
    """
    shared: list[set[tuple[str, str]]] = [set() for _ in range(folds)]
    for group, members in _groups().items():
        for place, one in enumerate(sorted(members, key=lambda one: _number(" ".join(one)))):
            # From a fold of the group's own, or the first would have more than the last.
            shared[(place + _number(group)) % folds].add(one)
    return shared


def fold_of(effect: str, form: str, folds: int = FOLDS) -> int | None:
    """Return the fold that keeps a form from learning; None for a kind that is held back."""
    one = effect, form
    return next((i for i, kept in enumerate(forms_by_fold(folds)) if one in kept), None)


def may_be_learned_from(truth: Mapping[str, Any], fold: int, folds: int = FOLDS) -> bool:
    """Return whether a session, by its truth file, may be shown to what is judged on a fold."""
    hidden = [(h["effect"], h["form"], h.get("held_back", False)) for h in truth["hidden"]]
    kept = forms_by_fold(folds)[fold]
    return not any(held_back or (effect, form) in kept for effect, form, held_back in hidden)


def _groups() -> dict[str, list[tuple[str, str]]]:
    """Return effect and form of what is spread over the folds, those that belong together."""
    listed = {effect: [(effect, f.form) for f in forms] for effect, forms in FORMS.items()}
    unlisted = [(f"outside:{name}", name) for name, kind in KINDS.items() if not kind.held_back]
    return listed | {"outside": unlisted}


def _number(name: str) -> int:
    return int(hashlib.sha256(name.encode()).hexdigest()[:12], 16)
