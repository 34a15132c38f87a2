"""``exoid detect`` of motions that nothing can be told from."""

import pytest

MOTION = (
    'unit = "rad"\nomega_rad_s = 0.628\ntheta0_rad = [0.6, -0.9]\na = [[{hip}], [0.0]]\nb = [[0.0],'
    " [0.0]]\n"
)


@pytest.mark.parametrize(("hip", "still"), [(0.0, "hip"), (0.3, "knee")])
def test_an_excitation_that_leaves_a_joint_at_rest_is_refused_in_one_line(
    exoid, tmp_path, hip, still
):
    path = tmp_path / "pose.toml"
    path.write_text(MOTION.format(hip=hip))
    outcome = exoid("detect", path)
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.startswith(f"exoid: {path}: exo_alone: the {still} moves for 0.0 s")
    assert outcome.err.count("\n") == 1
