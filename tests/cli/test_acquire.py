"""What `exoid acquire` says of a run that came to its end."""

import pytest

from pipelines.acquisition.acquire import Outcome
from pipelines.settings import datasets

CONFIG = """
[acquire]
rig = "{rig}"
sample_rate_hz = 100.0
[[run]]
name = "one"
run = "exo_alone"
purpose = "train"
duration_s = 10.0
"""


@pytest.fixture
def after(exoid, tmp_path, monkeypatch):
    """Return what is said after a run that missed so many samples and left so many set-points
    out."""

    def say(missed, left_out):
        result = Outcome(tmp_path / "one.parquet", 1000, missed, left_out)
        monkeypatch.setattr("pipelines.acquisition.acquire.acquire", lambda *a, **k: result)
        config = tmp_path / "exoid.toml"
        config.write_text(CONFIG.format(rig=(datasets() / "rigs" / "recorder.toml").as_posix()))
        outcome = exoid("acquire", "--config", config, "--run", "one")
        assert outcome.code == 0
        return outcome.err

    return say


def test_set_points_that_were_left_out_are_warned_of_though_no_sample_is_missing(after):
    """A recorder keeps every sample while the leg moves unevenly."""
    assert (
        "3 set-points were left out, since cycles took longer than 10 ms or answers were lost: the"
        " leg moved unevenly there; lower acquire.sample_rate_hz" in after(missed=0, left_out=3)
    )


def test_set_points_of_missed_samples_are_reported_once(after):
    output = after(missed=3, left_out=3)
    assert "3 samples were missed; `exoid show` lists the gaps" in output
    assert "left out" not in output
    assert "warning" not in after(missed=0, left_out=0)
