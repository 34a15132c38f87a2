"""How ``exoid diagnose`` tells a person what it found."""

import pytest

from exoid_cli.verdict_view import ERRORS, _in_words, show_verdict
from pipelines.contracts import HIP_AND_KNEE, Joint
from tests.report.sessions import verdict_of


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


@pytest.mark.parametrize(("status", "left"), [("explained", "5%"), ("nothing_missing", "too little")])
def test_what_chance_or_a_good_rig_may_have_left_is_told_by_no_share(capsys, status, left):
    show_verdict(verdict_of(status=status, causes=[]), HIP_AND_KNEE)
    (knee,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("knee")]
    assert knee.endswith(left)


def test_an_error_stands_beside_the_torque_that_it_is_of_and_older_files_lack_it(capsys):
    show_verdict(verdict_of(torque_rms_nm={"hip": 22.5, "knee": 12.25}), HIP_AND_KNEE)
    show_verdict(verdict_of(), HIP_AND_KNEE)
    knee, older = [line.split() for line in capsys.readouterr().out.splitlines() if line.startswith("knee ")][::2]
    assert knee[:3] == ["knee", "12.250", "0.272"]
    assert older[:2] == ["knee", "0.272"]


def test_a_gait_is_told_of_a_leg_alone(capsys):
    slide = [Joint("axis", "prismatic")]
    errors = {key: {"axis": 0.5} for key in (*ERRORS, "unexplained")}
    control = verdict_of()["control"] | {"reason": "the reference case is a leg's gait, with its gains and limits"}
    show_verdict(verdict_of(**errors, control=control), slide)
    assert "adaptive control" not in capsys.readouterr().out
    show_verdict(verdict_of(), HIP_AND_KNEE)
    assert "adaptive control" in capsys.readouterr().out
