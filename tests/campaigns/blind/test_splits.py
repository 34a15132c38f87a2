"""Folds keep each form from learning once, whatever order forms are written in."""

import pytest

from tests.campaigns.blind.causes import FORMS
from tests.campaigns.blind.outside import KINDS
from tests.campaigns.blind.splits import FOLDS, fold_of, forms_by_fold, may_be_learned_from


def test_every_form_is_kept_in_exactly_one_fold():
    kept = [one for fold in forms_by_fold() for one in fold]
    assert len(kept) == len(set(kept))
    assert set(kept) >= {(effect, f.form) for effect, forms in FORMS.items() for f in forms}


def test_an_effects_forms_are_spread_over_all_folds():
    for effect, forms in FORMS.items():
        folds = {fold_of(effect, f.form) for f in forms}
        assert len(folds) == min(FOLDS, len(forms))


def test_folds_are_of_like_size():
    sizes = [len(fold) for fold in forms_by_fold()]
    assert max(sizes) - min(sizes) < 0.4 * max(sizes)


def test_kinds_that_are_held_back_are_never_learned_from():
    held = [name for name, kind in KINDS.items() if kind.held_back]
    assert held and all(fold_of(f"outside:{name}", name) is None for name in held)
    truth = {"hidden": [{"effect": f"outside:{held[0]}", "form": held[0], "held_back": True}]}
    assert not any(may_be_learned_from(truth, fold) for fold in range(FOLDS))


@pytest.mark.parametrize("effect", ["cogging", "end_stop"])
def test_a_session_is_learned_from_in_all_folds_but_its_forms(effect):
    form = FORMS[effect][0].form
    truth = {"hidden": [{"effect": effect, "form": form}]}
    shown = [may_be_learned_from(truth, fold) for fold in range(FOLDS)]
    assert shown.count(False) == 1 and not shown[fold_of(effect, form)]
    assert may_be_learned_from({"hidden": []}, 0)
