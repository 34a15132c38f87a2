"""A cuff sensor whose counter goes back or leaps was restarted, and its zero may be another: the
run stops."""

import asyncio

import pytest

from pipelines.acquisition.machine import force_sensor
from pipelines.acquisition.machine.force_sensor import Sensor
from pipelines.acquisition.modbus.line import lines_of
from pipelines.errors import DeviceError
from pipelines.settings.rig import load_rig

RATE_HZ = 200.0
COUNTER = 'sequence = { address = 100, type = "uint32" }\nforce'
UINT16 = {COUNTER: COUNTER.replace("100", "101").replace("uint32", "uint16")}


@pytest.fixture
def is_new(monkeypatch, rig_file):
    """Let a sensor report counts, one every sample period; return which of them were new."""

    def read_counts(counts, rig="real_time", replace=None, every=1):
        rig = load_rig(rig_file(rig, replace=replace))
        now = iter(10.0 + k * every / RATE_HZ for k in range(10**6))
        instant = [next(now)]
        monkeypatch.setattr(force_sensor.time, "monotonic", lambda: instant[0])

        async def all_of_them():
            sensor_, new = Sensor(rig, rig.sensor[0], lines_of(rig)(rig.sensor[0])), []
            for count in counts:
                instant[0] = next(now)
                values = {"sequence": count, "force_x": 1.0, "force_y": 2.0, "force_z": 3.0}
                words = sensor_.reader.block.encode(values)

                async def read(*_, words=words, **__):
                    return words

                sensor_.device.read = read
                new.append(await sensor_.look() is not None)
            return new

        return asyncio.run(all_of_them())

    return read_counts


def test_a_counter_that_stands_brings_nothing_new_and_one_that_goes_on_does(is_new):
    assert is_new([5, 5, 6, 8, 8, 9]) == [True, False, True, True, False, True]


def test_a_counter_that_wraps_goes_on(is_new):
    assert is_new([65533, 65534, 65535, 0, 1], replace=UINT16) == [True] * 5


@pytest.mark.parametrize("rig", ["real_time", "plain"])
def test_a_counter_that_goes_back_stops_the_run(is_new, rig):
    with pytest.raises(
        DeviceError, match=r"sensor thigh_front .*went back from 500 to 3; was it restarted\?"
    ):
        is_new([*range(400, 501), 3], rig)


def test_a_counter_that_leaps_stops_the_run_though_its_register_is_narrow(is_new):
    with pytest.raises(DeviceError, match="leapt from 40200 to 65539"):
        is_new([*range(40000, 40201), 3], replace=UINT16)


@pytest.mark.parametrize("step", [1, 5, 50])
def test_a_sensor_may_count_faster_than_it_is_asked_and_be_held_up_for_a_while(is_new, step):
    counts = [step * k for k in range(300)]
    held_up = counts[:200] + [counts[200]] * 10 + [counts[200] + 11 * step]
    assert sum(is_new(counts)) == 300
    assert sum(is_new(held_up)) == 202


def test_in_lockstep_a_sensor_counts_as_fast_as_cycles_are_made(is_new):
    assert all(is_new([*range(200), 1000, 2000], "plain"))
