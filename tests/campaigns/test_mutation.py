"""What a mutation run makes of its results."""

import json

from tests.campaigns.mutation import killed_share


def test_survivors_lower_the_share_and_are_named(capsys):
    item = {
        "mutations": [
            {
                "module_path": "limits.py",
                "start_pos": [7, 0],
                "operator_name": "core/NumberReplacer",
            }
        ]
    }
    outcomes = ["killed", "killed", "killed", "survived"]
    lines = [json.dumps([item, {"test_outcome": outcome}]) for outcome in outcomes]
    assert killed_share("limits", "\n".join(lines)) == 0.75
    printed = capsys.readouterr().out
    assert "survived: limits.py:7 core/NumberReplacer" in printed
    assert "limits: 4 mutants, 75% killed" in printed
