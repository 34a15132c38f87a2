"""exoid on servers, and its rig under clients, that are built on other Modbus implementations than
its own."""

import ctypes

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pipelines.acquisition.acquire import acquire
from pipelines.contracts import RECORDING
from pipelines.mechanics.trajectory import read_trajectory
from pipelines.settings.acquire import RunSettings

ENABLE, DISABLE = 0x000F, 0x0000
LEGS = ("leg_on_pymodbustcp", "leg_on_libmodbus")
SERVERS = (*LEGS, "our_rig")


class Libmodbus:
    """A client on libmodbus: two calls of its C interface."""

    def __init__(self, library, port, unit):
        self._lib = ctypes.CDLL(library)
        self._lib.modbus_new_tcp.restype = ctypes.c_void_p
        self._context = ctypes.c_void_p(self._lib.modbus_new_tcp(b"127.0.0.1", port))
        self._lib.modbus_set_slave(self._context, unit)
        assert self._lib.modbus_connect(self._context) == 0

    def read(self, address, count):
        words = (ctypes.c_uint16 * count)()
        assert self._lib.modbus_read_registers(self._context, address, count, words) == count
        return list(words)

    def exchange(self, write_address, written, read_address, count):
        counter_and_angle, words = (
            (ctypes.c_uint16 * len(written))(*written),
            (ctypes.c_uint16 * count)(),
        )
        read = self._lib.modbus_write_and_read_registers(
            self._context,
            write_address,
            len(written),
            counter_and_angle,
            read_address,
            count,
            words,
        )
        assert read == count
        return list(words)

    def close(self):
        self._lib.modbus_close(self._context)
        self._lib.modbus_free(self._context)


@pytest.fixture
def libmodbus_client(libmodbus):
    """Connect a client on libmodbus to a port and unit; closed at the test's end."""
    clients = []

    def connect(port, unit):
        clients.append(Libmodbus(libmodbus, port, unit))
        return clients[-1]

    yield connect
    for client in clients:
        client.close()


@pytest.fixture
def pymodbustcp_client():
    """Connect a client of pyModbusTCP to a port and unit; closed at the test's end."""
    module = pytest.importorskip(
        "pyModbusTCP.client", reason="pyModbusTCP is not installed; `make install` brings it"
    )
    clients = []

    def connect(port, unit):
        clients.append(module.ModbusClient("127.0.0.1", port, unit_id=unit, timeout=20.0))
        return clients[-1]

    yield connect
    for client in clients:
        client.close()


@pytest.mark.parametrize("server", LEGS)
def test_a_whole_run_on_a_foreign_server_is_recorded_with_its_numbers(
    server, request, experiment, pymodbustcp_client, tmp_path
):
    settings = RunSettings(name="one", run="with_human", purpose="train", duration_s=1.0)
    output = tmp_path / "one.parquet"
    with request.getfixturevalue(server)() as port:
        rig, excitation = experiment(port)
        acquire(rig, settings, excitation, output)
        controls = [
            pymodbustcp_client(port, unit).read_holding_registers(202, 1) for unit in (1, 2)
        ]
    assert controls == [[DISABLE], [DISABLE]]

    table = RECORDING.read(output)
    frame = table.frame
    time, sample = frame["time_s"].to_numpy(), frame["sequence"].to_numpy()
    assert table.metadata["gaps"] == []
    assert (len(frame), set(np.diff(sample))) == (200, {1})
    assert sample[0] < 2**32 < sample[-1]  # the counter's register turned over in between
    assert_allclose(time, np.arange(200) / 200, atol=1e-9)

    wanted = read_trajectory(excitation).at(time + 0.5 / 200)[0]
    assert_allclose(table.stacked("reference"), wanted, atol=1e-6)
    angle = table.stacked("angle")
    assert_allclose(angle, wanted, atol=1e-6)
    assert_allclose(table.stacked("velocity")[1:], np.diff(angle, axis=0) * 200, atol=1e-5)
    # 0.1 mA counts of 1000 and a fiftieth of the angle's microradians, times 12 and 9.6 N·m/A.
    assert_allclose(table.stacked("torque"), (0.1 + 2.0 * angle) * [12.0, 9.6], atol=2e-3)
    assert_allclose(frame["hip_temperature_c"], 25.0 + 0.1 * (sample % 2**32 % 10), atol=1e-9)
    for unit, cuff in zip(
        (11, 12, 13, 14), ("thigh_front", "thigh_back", "shank_front", "shank_back"), strict=True
    ):
        assert (frame[f"{cuff}_force_x_n"] == unit).all()
        assert_allclose(frame[f"{cuff}_force_y_n"], 10.0 * angle[:, 0], atol=1e-5)
        assert_allclose(frame[f"{cuff}_force_z_n"], sample % 2**32 % 100)


@pytest.mark.parametrize("server", SERVERS)
def test_an_exchange_writes_before_it_reads(server, request, libmodbus_client):
    # The specification's order. exoid does not rely on it: what it reads is latched, see
    # docs/rig.md.
    with request.getfixturevalue(server)() as port:
        client = libmodbus_client(port, 1)
        assert client.exchange(200, [1, 2, DISABLE], 200, 3) == [1, 2, DISABLE]


@pytest.mark.parametrize("server", SERVERS)
def test_an_exchange_reads_the_sample_that_was_latched_before_its_set_point_took_effect(
    server, request, libmodbus_client
):
    def counter_and_angle(words):  # sequence, angle in force
        return (words[0] << 16 | words[1]), words[10] << 16 | words[11]

    with request.getfixturevalue(server)() as port:
        hip, knee = libmodbus_client(port, 1), libmodbus_client(port, 2)
        knee.exchange(200, [0, 0, ENABLE], 100, 14)
        first, before = counter_and_angle(hip.exchange(200, [0, 1234, ENABLE], 100, 14))
        knee.exchange(200, [0, 0, ENABLE], 100, 14)
        second, after = counter_and_angle(hip.exchange(200, [0, 5678, ENABLE], 100, 14))
    assert (before, after) == (0, 1234)
    assert second == (first + 1) % 2**32


def test_mbpoll_reads_identity_and_forces_of_our_rig(mbpoll, our_rig):
    with our_rig() as port:
        assert mbpoll(port, 1, 0, "4:hex", count=2)[:2] == (0, ["0x4558", "0x0002"])
        status, forces, _ = mbpoll(port, 12, 102, "4:float", count=3)
        assert status == 0
        # Thigh weight, preload and noise, nothing like the bits of another word order.
        assert all(abs(float(force)) < 400.0 for force in forces) and any(
            abs(float(force)) > 1.0 for force in forces
        )
        assert mbpoll(port, 1, 104, "4:int", count=1)[1] == ["0"]  # it hangs at rest


def test_mbpoll_writes_registers_of_our_rig_and_learns_which_do_not_exist(mbpoll, our_rig):
    with our_rig() as port:
        assert mbpoll(port, 2, 200, "4", 0, 77, 0)[0] == 0
        assert mbpoll(port, 2, 200, "4", count=3)[:2] == (0, ["0", "77", "0"])
        _, values, complaint = mbpoll(port, 2, 300, "4", count=1)
        assert values == [] and "Illegal data address" in complaint
        _, values, complaint = mbpoll(port, 99, 100, "4", count=1)
        assert values == [] and "Target device failed to respond" in complaint


def test_pymodbustcp_moves_our_rig_sample_by_sample(our_rig, pymodbustcp_client):
    with our_rig() as port:
        hip, knee = pymodbustcp_client(port, 1), pymodbustcp_client(port, 2)
        assert hip.read_holding_registers(0, 2) == [0x4558, 2]
        assert hip.write_multiple_registers(200, [0, 0, ENABLE])
        samples = []
        for microradian in range(0, 5000, 100):
            drives = [
                drive.write_read_multiple_registers(200, [0, microradian, ENABLE], 100, 14)
                for drive in (hip, knee)
            ]
            assert drives[0][:4] == drives[1][:4]  # latched together
            samples.append(drives[0])
        sequence = [words[0] << 16 | words[1] for words in samples]
        assert np.diff(sequence).tolist() == [1] * 49
        # Each in force one sample later.
        assert [words[11] for words in samples[2:]] == list(range(100, 4900, 100))
        assert 1000 < samples[-1][5] < 4900  # the leg follows
        assert hip.write_multiple_registers(200, [0, 0, DISABLE])
