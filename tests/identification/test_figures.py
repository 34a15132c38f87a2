"""Every validation run gets its figures, one in which nothing can be scored too."""

import numpy as np

from exoid_cli.app import run
from pipelines.contracts import RECORDING
from tests.diagnosis.machines import RATE_HZ, pendulum, table


def resting(seconds=4.0):
    """A servo that holds its arm where it is."""
    time = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    noise = np.random.default_rng(9).normal(0.0, 0.01, len(time))
    angle = np.where(time < 0.5 * seconds, 0.3, 0.3001)
    return table(
        time, angle, 0.4 + noise, {"name": "arm", "kind": "revolute"}, "validate", gravity_m_s2=9.81
    )


def test_a_validation_run_of_a_joint_at_rest_is_drawn_and_said_to_have_nothing_to_score(
    tmp_path, capsys
):
    runs = {"one": pendulum("train", 1), "two": pendulum("validate", 2), "rest": resting()}
    for name, made in runs.items():
        RECORDING.write(tmp_path / f"{name}.parquet", made.frame, made.metadata)
    files = [str(tmp_path / f"{name}.parquet") for name in runs]
    assert run(["identify", *files, "-o", str(tmp_path / "identified")]) == 0, (
        capsys.readouterr().err
    )
    assert (tmp_path / "identified" / "residual-rest.png").exists()
    assert (tmp_path / "identified" / "residual-two.png").exists()
