import pytest

from pipelines.errors import SettingsError
from pipelines.rig.sealed import hidden_effects
from pipelines.settings import datasets

SHIPPED = datasets() / "rigs" / "sealed" / "default.toml"


@pytest.fixture
def with_seed(tmp_path):
    def write(seed, hidden=1):
        path = tmp_path / f"{seed}.toml"
        text = SHIPPED.read_text()
        old_seed = next(line for line in text.splitlines() if line.startswith("seed"))
        path.write_text(
            text.replace(old_seed, f"seed = {seed}").replace("hidden = 1", f"hidden = {hidden}")
        )
        return path

    return write


def test_one_seed_hides_one_thing(with_seed):
    (first,), (second,) = hidden_effects(with_seed(5)), hidden_effects(with_seed(5))
    assert first.effect == second.effect
    assert first.values.tolist() == second.values.tolist()


def test_seeds_reach_every_possibility_and_keep_its_ranges(with_seed):
    drawn = [hidden_effects(with_seed(seed))[0] for seed in range(40)]
    assert {term.effect.name for term in drawn} == {
        "stribeck_friction",
        "presliding_hysteresis",
        "joint_elasticity",
        "encoder_offset",
    }
    assert {term.effect.joint for term in drawn} == {"hip", "knee"}
    offsets = [abs(term.values[0]) for term in drawn if term.effect.name == "encoder_offset"]
    assert all(0.04 <= offset <= 0.1 for offset in offsets)


def test_several_hidden_effects_are_different_ones(with_seed):
    names = [term.effect.name for term in hidden_effects(with_seed(1, hidden=4))]
    assert len(set(names)) == 4


def test_the_default_experiment_hides_something():
    assert len(hidden_effects(SHIPPED)) == 1


def test_more_cannot_be_hidden_than_there_is(with_seed):
    path = with_seed(1, hidden=9)
    with pytest.raises(SettingsError) as caught:
        hidden_effects(path)
    assert str(caught.value) == f"{path}: hidden: found 9, expected at most 4"
