"""How ``exoid diagnose`` tells a person what it found."""

import re

import pytest

from exoid_cli.console import console
from exoid_cli.verdict_view import _in_words, show_verdict
from pipelines.contracts import HIP_AND_KNEE, Joint
from pipelines.contracts.verdict import Parameter
from tests.report.sessions import checked_verdict, decision_of, verdict_of


@pytest.fixture(autouse=True)
def a_person_reads_along():
    """Whatever options a command of another test was given."""
    console.reset()


ROW = re.compile(r"^( *)(\w.*?) +([01]\.\d\d)$", flags=re.MULTILINE)
"""A line of a table of probabilities."""


@pytest.mark.parametrize(
    ("value", "unit", "ci95", "output"),
    [
        (1.932, "N·m", [1.9, 2.0], "play 1.932 N·m (1.9 … 2)"),
        (0.9457, "1", [0.9383, 0.9531], "play 0.9457 (0.9383 … 0.9531)"),
        (60.0, "1/rad²", [60.0, 60.0], "play 60 1/rad² (taken, not fitted)"),
    ],
    ids=["measured", "a pure number", "chosen"],
)
def test_a_parameter_has_its_unit_and_an_interval_only_if_it_was_fitted(value, unit, ci95, output):
    parameter = Parameter(name="play", value=value, unit=unit, ci95=ci95)
    assert _in_words(parameter) == output


def test_where_no_cause_is_named_no_error_with_causes_is_shown(capsys):
    show_verdict(checked_verdict(status="nothing_missing", causes=[]), HIP_AND_KNEE)
    printed = capsys.readouterr().out
    assert "with the causes" not in printed
    assert "excess left" not in printed


def test_errors_that_the_causes_increase_are_printed_below_those_that_fall(capsys):
    grown = {
        "baseline_rmse_unmasked_nm": {"hip": 0.8, "knee": 2.95},
        "extended_rmse_unmasked_nm": {"hip": 0.4, "knee": 3.38},
    }
    show_verdict(checked_verdict(**grown), HIP_AND_KNEE)
    printed = " ".join(capsys.readouterr().out.split())
    assert (
        "Reversals included, the knee's torque error is 2.95 → 3.38 N·m with the causes" in printed
    )
    show_verdict(checked_verdict(), HIP_AND_KNEE)
    assert "Reversals included" not in capsys.readouterr().out


def test_an_error_stands_next_to_its_torque_which_older_files_lack(capsys):
    show_verdict(checked_verdict(torque_rms_nm={"hip": 22.5, "knee": 12.25}), HIP_AND_KNEE)
    show_verdict(checked_verdict(), HIP_AND_KNEE)
    knee, older = [
        line.split() for line in capsys.readouterr().out.splitlines() if line.startswith("knee ")
    ][::2]
    assert knee[:3] == ["knee", "12.250", "0.272"]
    assert older[:2] == ["knee", "0.272"]


def test_a_gait_is_printed_of_a_leg_alone(capsys):
    slide = [Joint("axis", "prismatic")]
    control = verdict_of(slide)["control"] | {
        "reason": "the reference case is a leg's gait, with its gains and limits"
    }
    show_verdict(checked_verdict(slide, control=control), slide)
    assert "adaptive control" not in capsys.readouterr().out
    show_verdict(checked_verdict(), HIP_AND_KNEE)
    assert "adaptive control" in capsys.readouterr().out


def shown(capsys, **decision):
    show_verdict(checked_verdict(**decision), HIP_AND_KNEE)
    return capsys.readouterr().out


def probabilities(printed):
    """Indentation, words and hundredths of each line that ends in a probability."""
    return [(len(blank), words, round(100 * float(p))) for blank, words, p in ROW.findall(printed)]


@pytest.mark.parametrize("nothing", [0.0, 0.0149, 0.033, 0.97])
@pytest.mark.parametrize("law", [0.0051, 0.0249, 0.02])
def test_the_three_cases_add_up_to_one_as_they_are_printed(capsys, nothing, law):
    cases = probabilities(shown(capsys, **decision_of(nothing=nothing, law=law)))[:3]
    assert [words for _, words, _ in cases] == [
        "nothing",
        "listed causes only",
        "something unlisted",
    ]
    assert sum(p for *_, p in cases) == 100


def test_the_path_leads_from_the_joint_over_the_family_to_the_cause(capsys):
    lines = probabilities(shown(capsys, **decision_of(ties=(), law=0.0, nothing=0.04)))[3:]
    assert lines == [
        (0, "something that repeats with the motion", 96),
        (2, "something at the knee", 96),
        (4, "a law of the knee's angle", 96),
        (6, "cogging at the knee", 96),
    ]


def test_tied_causes_are_printed_each_and_their_probabilities_add_up_to_the_joint_one(capsys):
    lines = probabilities(shown(capsys, **decision_of(ties=("parallel_spring", "end_stop"))))
    (at,) = [k for k, (_, words, _) in enumerate(lines) if "cannot separate" in words]
    together, members = lines[at], lines[at + 1 : at + 4]
    assert [words for _, words, _ in members] == [
        "cogging at the knee",
        "parallel spring at the knee",
        "end stop at the knee",
    ]
    assert all(indent == together[0] + 2 for indent, *_ in members)
    assert abs(sum(p for *_, p in members) - together[2]) <= 1  # each is rounded


def test_no_line_is_less_probable_than_one_below_it(capsys):
    lines = probabilities(shown(capsys, **decision_of()))[3:]
    above = {}
    for indent, _, p in lines:
        assert p <= above.get(indent - 2, 100)
        above[indent] = p


def test_two_findings_share_the_lines_above_both(capsys):
    decision = decision_of(ties=(), law=0.0)
    (first,) = decision["findings"]
    law = {"law": "load", "joint": "knee", "probability": 0.8, "words": "a law of the knee's load"}
    path = [
        *first["path"][:3],
        first["path"][3] | {"value": "load", "words": "a law of the knee's load"},
    ]
    second = first | {
        "level": "family",
        "family": "load",
        "causes": [],
        "laws": [law],
        "path": path,
    }
    words = [
        words
        for _, words, _ in probabilities(shown(capsys, **decision | {"findings": [first, second]}))[
            3:
        ]
    ]
    assert words == [
        "something that repeats with the motion",
        "something at the knee",
        "a law of the knee's angle",
        "cogging at the knee",
        "a law of the knee's load",
        "unlisted: a law of the knee's load",
    ]


def test_what_is_known_to_be_missing_and_no_more_has_a_line(capsys):
    decision = decision_of()
    (first,) = decision["findings"]
    only = first | {"level": "repeatability", "causes": [], "laws": [], "path": first["path"][:1]}
    lines = probabilities(shown(capsys, **decision | {"findings": [only]}, causes=[]))[3:]
    assert lines == [(0, "something is missing", 97)]


def test_a_line_that_is_too_long_goes_on_below_itself_and_keeps_its_probability(
    capsys, monkeypatch
):
    monkeypatch.setattr(console.out, "_width", 80)
    decision = decision_of(ties=())
    decision["findings"][0]["laws"][0]["words"] = (
        "friction of the knee that depends on the other joint's angle " + "so"
    )
    printed = shown(capsys, **decision)
    assert max(map(len, printed.splitlines()[2:14])) <= 80
    (first,) = [line for line in printed.splitlines() if "unlisted: friction" in line]
    assert first.endswith("0.02")


def test_shares_of_the_residual_have_columns_where_there_is_something(capsys):
    printed = shown(capsys, **decision_of())
    assert "joint  noise  repeats  wanders  per run  angle  speed\n" in printed
    assert "knee     20%      70%       8%       2%    80%    20%\n" in printed


def test_a_fault_of_acquisition_says_that_no_cause_was_looked_for_and_lists_every_fault(capsys):
    fault = {
        "file": "run_1.parquet",
        "channel": "hip_angle_rad",
        "what": "the hip's angle is stuck",
    }
    other = fault | {"file": "run_2.parquet"}
    decision = decision_of() | {"findings": [], "posterior": None}
    printed = shown(
        capsys, acquisition_at_fault=True, causes=[], data_faults=[fault, other], **decision
    )
    assert "No cause was sought. Correct the acquisition, or accept it." in printed
    assert "- run_2.parquet, hip_angle_rad: the hip's angle is stuck" in printed
    assert "is anything missing?" not in printed


def test_a_verdict_of_an_older_version_is_shown_without_findings(capsys):
    assert "is anything missing?" not in shown(capsys)


def test_what_slides_depends_on_its_position(capsys):
    joints = (Joint("axis", "prismatic"),)
    show_verdict(checked_verdict(joints, **decision_of(joints)), joints)
    assert "per run  position  speed\n" in capsys.readouterr().out
