"""What exoid.toml says of the machine: it has to be one that exoid knows."""

import pytest

from pipelines.errors import SettingsError
from pipelines.mechanics.geometry import Geometry
from pipelines.mechanics.read import geometry_from
from pipelines.settings import Experiment


def joints(*kinds):
    return "".join(
        f'[[mechanism.joints]]\nname = "q{i}"\nkind = "{kind}"\n' for i, kind in enumerate(kinds)
    )


def experiment(folder, text):
    path = folder / "exoid.toml"
    path.write_text(text, encoding="utf-8")
    return Experiment.load(path)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            joints("prismatic"),
            (
                "mechanism.joints: found q0 (prismatic), expected revolute, revolute for leg; "
                "correct the joints, or set name to single"
            ),
        ),
        (
            '[mechanism]\nname = "single"\n' + joints("revolute", "revolute"),
            (
                "mechanism.joints: found q0 (revolute), q1 (revolute), expected revolute or"
                " prismatic for single; correct the joints, or set name to leg"
            ),
        ),
        (
            '[mechanism]\nname = "single"\n' + joints("prismatic", "revolute"),
            (
                "mechanism.joints: found q0 (prismatic), q1 (revolute), expected revolute or"
                " prismatic for single; correct the joints"
            ),
        ),
        (
            '[mechanism]\nname = "sinlge"\n' + joints("prismatic"),
            (
                "mechanism.name: found 'sinlge', expected a mechanism's name, or a file for a new"
                " one (docs/mechanisms.md); did you mean single?"
            ),
        ),
        (
            '[mechanism]\nname = "arm"\n' + joints("prismatic"),
            (
                "mechanism.name: found 'arm', expected a mechanism's name, or a file for a new one"
                " (docs/mechanisms.md); known are leg, single"
            ),
        ),
    ],
)
def test_a_mechanism_that_there_is_not_is_refused_with_what_to_do(tmp_path, text, told):
    given = experiment(tmp_path, text)
    with pytest.raises(SettingsError) as caught:
        geometry_from(given)
    assert str(caught.value) == f"{tmp_path / 'exoid.toml'}: {told}"


def test_a_mechanism_that_there_is_gives_its_geometry_and_none_gives_none(tmp_path):
    given = experiment(
        tmp_path, '[mechanism]\nname = "single"\ngravity_m_s2 = 0.0\n' + joints("prismatic")
    )
    assert geometry_from(given) == Geometry(gravity_m_s2=0.0)
    assert geometry_from(experiment(tmp_path, "")) is None
