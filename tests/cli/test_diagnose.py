"""How ``exoid diagnose`` tells a person what it found."""

import pytest

from exoid_cli.verdict_view import _in_words


@pytest.mark.parametrize(
    ("value", "unit", "ci95", "said"),
    [
        (1.932, "N·m", [1.9, 2.0], "play 1.932 N·m (1.9 … 2)"),
        (0.9457, "1", [0.9383, 0.9531], "play 0.9457 (0.9383 … 0.9531)"),
        (60.0, "1/rad²", [60.0, 60.0], "play 60 1/rad² (taken, not fitted)"),
    ],
    ids=["measured", "a pure number", "chosen"],
)
def test_a_parameter_has_its_unit_and_an_interval_only_if_it_was_fitted(value, unit, ci95, said):
    assert _in_words({"name": "play", "value": value, "unit": unit, "ci95": ci95}) == said
