"""``exoid export``: what the user sees, and what is written."""

import json

import pytest

from pipelines.contracts import PARAMETERS
from tests.export.machines import LEG, named, table_of


@pytest.fixture
def model(tmp_path):
    """An extended model, as diagnose writes it."""

    def write(*terms, **options):
        table = table_of(*LEG, *terms, **options)
        path = tmp_path / "parameters.parquet"
        PARAMETERS.write(path, table.frame, table.metadata)
        return path

    return write


@pytest.mark.parametrize(
    ("to", "files"),
    [
        ("mjcf", ["leg.xml"]),
        ("urdf", ["leg.urdf"]),
        ("json", ["leg.json"]),
        ("matlab", ["leg.m"]),
        ("c", ["leg.c", "leg.h"]),
    ],
)
def test_each_format_is_written_and_printed(exoid, model, tmp_path, to, files):
    outcome = exoid(
        "export",
        model(named("stribeck_friction@knee")),
        "--to",
        to,
        "-o",
        tmp_path / "out" / files[0],
    )
    assert outcome.code == 0, outcome.err
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == files
    assert "stribeck_friction@knee" in outcome.out and "the with_human model" in outcome.out
    assert ("not in the file" in outcome.err) == (to in ("mjcf", "urdf"))


def test_a_term_left_out_is_warned_of_with_its_parameters_and_listed_in_the_json(
    exoid, model, tmp_path
):
    outcome = exoid("export", model(named("stribeck_friction@knee")), "--to", "mjcf", "--json")
    assert (
        "warning: stribeck_friction@knee is not in the file (MJCF has no element for it): "
        "stribeck_torque = 3 N·m, stribeck_velocity = 0.15 rad/s, exponent = 2" in outcome.err
    )
    output = json.loads(outcome.out)
    assert output["files"] == [str(tmp_path / "parameters.xml")]
    (remaining,) = [term for term in output["terms"] if term["held"] == "left out"]
    assert remaining["parameters"]["stribeck_velocity"] == {"value": 0.15, "unit": "rad/s"}


def test_show_knows_the_json_document(exoid, model, tmp_path):
    exoid("export", model(), "--to", "json", "-o", tmp_path / "leg.json")
    outcome = exoid("show", tmp_path / "leg.json")
    assert (
        outcome.code == 0
        and "model/1, a model, as `exoid export --to json` writes it" in outcome.out
    )
    assert "parameters.parquet" in outcome.out


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--to", "mjfc"), "--to mjfc: there is no such format; did you mean mjcf?"),
        (
            ("--to", "urdf", "--run", "human"),
            "holds no rigid body for run 'human', only for with_human; set --run",
        ),
        (("--to", "c", "-o", "my leg.c"), "my leg.c: its functions have the file's name"),
        (
            ("--to", "c", "-o", "x.xml"),
            "-o x.xml: is a file name of --to mjcf, expected .c with --to c",
        ),
        (
            ("--to", "urdf", "-o", "leg.xml"),
            "-o leg.xml: is a file name of --to mjcf, expected .urdf with --to urdf",
        ),
        (
            ("--to", "json", "-o", "parameters.parquet"),
            "parameters.parquet: is the model itself; choose another file",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    exoid, model, tmp_path, monkeypatch, arguments, complaint
):
    monkeypatch.chdir(tmp_path)
    outcome = exoid("export", model(), *arguments)
    assert outcome.code == 2 and complaint in outcome.err and outcome.err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["parameters.parquet"]


def test_a_leg_that_cannot_be_is_refused_with_file_and_reason(exoid, model, tmp_path):
    import numpy as np

    from pipelines.effects.baseline import RigidBody
    from pipelines.model import Term

    path = tmp_path / "unreal.parquet"
    table = table_of(Term(RigidBody(), np.array([1.0, 0.9, 2.0, 5.0])))
    PARAMETERS.write(path, table.frame, table.metadata)
    outcome = exoid("export", path, "--to", "mjcf")
    assert (
        outcome.code == 2
        and "unreal.parquet: the with_human parameters are not those of a real leg: X2 (X1 - X2)"
        in outcome.err
    )
    assert [p.name for p in tmp_path.iterdir()] == ["unreal.parquet"]
