"""Labels of unlisted laws are read as they are written."""

import pytest

from pipelines.wording.law import kind_and_joint, law_label


@pytest.mark.parametrize("wearer", ["all", "human"])
@pytest.mark.parametrize(("kind", "joint"), [("angle", "hip"), ("both_angles", None)])
def test_a_label_gives_kind_and_joint_again_whoever_wears_the_machine(kind, joint, wearer):
    assert kind_and_joint(law_label(kind, joint, wearer)) == (kind, joint)
