"""What a set-point's register rounds off neither leads beyond a limit nor makes the leg leap."""

import asyncio

import pytest

from pipelines.acquisition.acquire import acquire
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.preconditions.set_point_resolution import refuse_coarse_set_points
from pipelines.errors import SettingsError
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig

COARSE = {'scale = 1e-6, unit = "rad" }\ncontrol': 'scale = 0.19, unit = "deg" }\ncontrol'}


def test_set_points_that_would_leap_a_count_are_refused_at_the_rate_at_which_they_would(
    rig_file, excitation, tmp_path
):
    path = rig_file(replace=COARSE)
    refuse_coarse_set_points(load_rig(path).in_force("with_human"), 100.0)
    run = RunSettings(name="test", run="with_human", purpose="train", duration_s=1.0)
    with pytest.raises(SettingsError) as caught:
        acquire(path, run, excitation, tmp_path / "test.parquet", 200.0)
    assert (
        str(caught.value)
        == f"{path}: map.drive.servo.write.reference: one count is 0.00332 rad, expected at most"
        " 0.00275 rad, a quarter of the hip's longest step; correct its scale, or lower"
        " acquire.sample_rate_hz"
    )


@pytest.mark.parametrize("angle", [-0.35, 1.75])
def test_a_set_point_at_a_limit_is_not_rounded_beyond_it(rig_file, angle):
    async def build():  # a connection belongs to an event loop
        return Machine(load_rig(rig_file(replace=COARSE)), with_sensors=False).drives[0]

    drive = asyncio.run(build())
    sent = drive.write_block.decode(drive.words(drive.map.enable, angle))["reference"]
    assert -0.35 <= sent <= 1.75
    assert sent == pytest.approx(angle, abs=drive.map.write.reference.step)
