"""Lines of every transport, over real sockets, real TLS and a pseudo-terminal pair."""

import asyncio
import errno
import re
import shutil
import ssl
import subprocess
import time
from datetime import UTC, datetime, timedelta

import pytest
import serial
from pymodbus.framer import FramerRTU
from pymodbus.server.base import ModbusBaseServer

from pipelines.acquisition.acquire import acquire
from pipelines.acquisition.machine.machine import Machine
from pipelines.acquisition.modbus.connection import explain
from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.line import Line, lines_of
from pipelines.contracts import RECORDING
from pipelines.errors import DeviceError, SettingsError, Unanswered
from pipelines.rig.listening import _tls_context
from pipelines.rig.null_modem import null_modem
from pipelines.settings.acquire import RunSettings
from pipelines.settings.rig import load_rig
from pipelines.settings.rig.line import RtuLine, RtuOverTcpLine
from pipelines.settings.rig.safety import SafetySettings
from tests.acquisition.conftest import free_port

pytestmark = pytest.mark.long

TRANSPORTS = ("tcp", "rtu", "rtu_over_tcp", "tls")


@pytest.fixture(scope="session")
def certificates(tmp_path_factory):
    """A certificate of this computer's own with its key, PEM; and another that nobody has signed
    either."""
    if shutil.which("openssl") is None:
        pytest.skip("needs the openssl command to make a certificate")
    folder = tmp_path_factory.mktemp("certificates")
    for name in ("own", "other"):
        subprocess.run(
            [
                "openssl",
                "req",
                "-x509",
                "-newkey",
                "ec",
                "-pkeyopt",
                "ec_paramgen_curve:P-256",
                "-nodes",
                "-days",
                "2",
                "-subj",
                f"/CN={name}",
                "-addext",
                "subjectAltName=IP:127.0.0.1",
                "-keyout",
                f"{name}.key",
                "-out",
                f"{name}.pem",
            ],
            cwd=folder,
            check=True,
            capture_output=True,
        )
    locked = [
        "openssl",
        "pkey",
        "-in",
        "own.key",
        "-aes256",
        "-passout",
        "pass:secret",
        "-out",
        "locked.key",
    ]
    subprocess.run(locked, cwd=folder, check=True, capture_output=True)
    return folder


@pytest.fixture
def line_of(tmp_path, request):
    """Return the table of a line by transport, each at a place of its own."""

    def table(transport, **more):
        keys = {"transport": transport}
        if transport == "rtu":
            # Without silence, which would only make the tests long.
            keys |= {
                "serial_port": str(tmp_path / "port"),
                "baud_rate": 115200,
                "parity": "none",
                "silence_s": 0.0,
            }
        else:
            keys |= {"port": free_port()}
        if transport == "tls":
            own = {"ca": "own.pem", "certificate": "own.pem", "key": "own.key"}
            own |= {"rig_certificate": "own.pem", "rig_key": "own.key"}
            folder = request.getfixturevalue("certificates")
            keys |= {key: str(folder / file) for key, file in own.items()}
        keys |= more
        return "".join(f"{k} = {v!r}\n" for k, v in keys.items())

    return table


@pytest.fixture
def on_line(rig_file):
    """Write a rig file with all of its devices on one line, the table of which is given."""

    def write(table, name="leg", ramp_s=0.3, watchdog_s=10.0, **changes):
        devices = {
            'map = "servo"': f'map = "servo"\nline = "{name}"',
            'map = "force"': f'map = "force"\nline = "{name}"',
        }
        return rig_file(
            ramp_s=ramp_s,
            watchdog_s=watchdog_s,
            replace={
                **devices,
                "[map.drive.servo]\n": f"[line.{name}]\n{table}\n[map.drive.servo]\n",
            },
            **changes,
        )

    return write


@pytest.fixture
def record_on(tmp_path, excitation, serve):
    """Record a short run on a rig file that is served where it says; returns the recording."""

    def run(path, run="with_human", fault=None, served_as=None, rate_hz=200.0):
        settings = RunSettings(name="test", run=run, purpose="train", duration_s=0.5, seed=7)
        output = tmp_path / f"{path.stem}.parquet"
        with serve(path, None, run, 7, fault) as served:
            if served_as is not None:
                served_as.append(served)
            acquire(path, settings, excitation, output, rate_hz)
        return RECORDING.read(output)

    return run


def test_every_transport_brings_the_same_numbers(line_of, on_line, record_on, rig_file):
    each_its_own = record_on(rig_file(port=free_port(), ramp_s=0.3, watchdog_s=10.0)).frame
    assert len(each_its_own) == 100
    for transport in TRANSPORTS:
        assert record_on(on_line(line_of(transport))).frame.equals(each_its_own), transport


def test_devices_can_be_on_several_lines_of_different_kinds(line_of, on_line, record_on, rig_file):
    serial_line, gateway = line_of("rtu"), line_of("rtu_over_tcp")
    mixed = rig_file(
        port=free_port(),
        ramp_s=0.3,
        watchdog_s=10.0,
        replace={
            'unit = 2\nmap = "servo"\n': 'unit = 2\nline = "knee"\nmap = "servo"\n',
            'unit = 13\nmap = "force"\n': 'unit = 13\nline = "cuffs"\nmap = "force"\n',
            "[map.drive.servo]\n": (
                f"[line.knee]\n{serial_line}\n[line.cuffs]\n{gateway}\n[map.drive.servo]\n"
            ),
        },
    )
    # The two that are on lines are nowhere else.
    text = re.sub(r'(line = "\w+"\nmap = "\w+"\n)port = \d+\n', r"\1", mixed.read_text())
    mixed.write_text(text)
    assert record_on(mixed).frame.equals(record_on(on_line(line_of("tcp"))).frame)


def test_an_embedded_rig_is_found_on_a_serial_line(tmp_path, excitation, on_line, line_of):
    path = on_line(line_of("rtu"))
    path.write_text(path.read_text().replace("embedded = false", "embedded = true"))
    settings = RunSettings(name="test", run="exo_alone", purpose="train", duration_s=0.5)
    outcome = acquire(path, settings, excitation, tmp_path / "test.parquet")
    assert (outcome.samples, outcome.missed) == (100, 0)
    assert not (tmp_path / "port").exists()


def on(path, ask):
    """Connect the rig in a file and return what ``ask(machine)`` finds."""

    async def run():
        machine = Machine(load_rig(path), with_sensors=True)
        await machine.connect()
        try:
            return await ask(machine)
        finally:
            machine.close()

    return asyncio.run(run())


@pytest.mark.parametrize("transport", TRANSPORTS)
def test_devices_on_one_line_asked_all_at_once_each_get_their_own_answer(
    serve, on_line, line_of, transport
):
    path = on_line(line_of(transport))

    async def identities(machine):
        assert len({part.device.line for part in machine._parts}) == 1
        return await asyncio.gather(*(part.device.read(0, 1) for part in machine._parts * 5))

    with serve(path, None, "with_human"):
        values = on(path, identities)
    assert values == ([[0x4558]] * 2 + [[0x4653]] * 4) * 5


def test_a_line_is_quiet_before_each_request_for_as_long_as_the_rig_file_says(
    serve, on_line, line_of
):
    path = on_line(line_of("rtu", silence_s=0.02))

    async def ask(machine):
        began = time.monotonic()
        for _ in range(10):
            await machine.drives[0].device.read(0, 1)
        return time.monotonic() - began

    with serve(path, None):
        assert on(path, ask) >= 0.2


@pytest.mark.parametrize("transport", TRANSPORTS)
def test_a_lost_line_is_one_error_that_names_it_and_all_who_are_on_it(
    serve, on_line, line_of, transport
):
    path = on_line(line_of(transport))
    with serve(path, None) as served:

        async def ask(machine):
            began = time.monotonic()
            served.stop()
            answers = await asyncio.gather(
                *(d.device.read(0, 1) for d in machine.drives), return_exceptions=True
            )
            return time.monotonic() - began, answers

        waited, answers = on(path, ask)
    place = load_rig(path).line["leg"].place
    messages = {str(answer) for answer in answers}
    devices = (
        "drive hip (unit 1), drive knee (unit 2), sensor thigh_front (unit 11), sensor thigh_back"
        " (unit 12), "
    )
    why = "; check cable and power"
    if transport != "rtu":
        why = (
            ": the device closed the connection; end other programs that use it, or see whether it"
            " restarted or limits idle time"
        )
    assert messages == {
        f"line leg ({place}): the line is lost, and with it {devices}sensor shank_front (unit 13),"
        f" sensor shank_back (unit 14){why}"
    }
    assert waited < 10.0  # it is not waited for an answer that cannot come


def test_a_line_lost_in_a_run_stops_it_and_is_reported_once(on_line, line_of, record_on):
    served, remaining = [], [200]

    def pull_the_plug(device, function, written):
        remaining[0] -= 1
        if remaining[0] == 0:
            served[0].stop_soon()

    with pytest.raises(DeviceError) as caught:
        record_on(on_line(line_of("rtu"), watchdog_s=1.0), "exo_alone", pull_the_plug, served)
    assert str(caught.value).count("the line is lost") == 1
    assert str(caught.value).count("no such serial port") == 1


def test_after_a_broken_connection_the_drives_are_disabled_on_a_new_one(
    on_line, line_of, record_on
):
    served, remaining = [], [200]

    def hang_up(device, function, written):
        remaining[0] -= 1
        if remaining[0] == 0:
            (connection,) = list(ModbusBaseServer.active_server.active_connections.values())
            connection.close()

    with pytest.raises(DeviceError, match=r"line leg .* is lost.*; the leg was stopped"):
        record_on(on_line(line_of("tcp"), watchdog_s=1.0), "exo_alone", hang_up, served)
    assert served[0].enabled == [False, False]


def connecting(path):
    with pytest.raises((DeviceError, SettingsError)) as caught:
        on(path, None)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_serial_port_that_is_not_there_is_named_with_those_that_are(on_line, line_of, tmp_path):
    why = connecting(on_line(line_of("rtu")))
    assert why.startswith(f"line leg ({tmp_path}/port): no such serial port; there is ")
    assert why.endswith("plug the adapter in, or correct serial_port")


def test_a_serial_port_that_another_program_uses_is_not_shared(serve, on_line, line_of, tmp_path):
    path = on_line(line_of("rtu"))
    with serve(path, None), serial.Serial(str(tmp_path / "port"), exclusive=True):
        assert (
            connecting(path)
            == f"line leg ({tmp_path}/port): the serial port is busy; end the other program that"
            " uses it"
        )


def test_a_serial_port_without_permission_says_how_to_get_it():
    # As root, who may everything, tests cannot meet the real thing.
    assert "usermod -aG dialout" in explain(
        serial.SerialException(errno.EACCES, "Permission denied")
    )


def test_a_path_that_is_no_serial_port_is_refused(on_line, line_of, tmp_path):
    (tmp_path / "port").write_text("")
    assert connecting(on_line(line_of("rtu"))).startswith(
        f"line leg ({tmp_path}/port): no connection ("
    )


def test_settings_that_a_serial_port_does_not_support_are_reported(serve, on_line, line_of):
    path = on_line(line_of("rtu", parity="even"))
    with serve(path, None):
        assert "cannot be set up like that" in connecting(path)


def test_a_rig_whose_certificate_has_no_trusted_issuer_is_not_trusted(
    serve, on_line, line_of, certificates
):
    path = on_line(line_of("tls"))
    with serve(path, None):
        believed = path.with_name("believed.toml")
        believed.write_text(
            path.read_text().replace(f"ca = '{certificates}/own", f"ca = '{certificates}/other")
        )
        assert "its certificate is not trusted (self-signed certificate" in connecting(believed)


@pytest.mark.parametrize(
    ("days", "reason"), [(-2, "certificate has expired"), (2, "certificate is not yet valid")]
)
def test_a_certificate_that_is_not_valid_now_is_reported_as_that(
    serve, on_line, line_of, certificates, tmp_path, days, reason
):
    stamp = [f"{datetime.now(UTC) + timedelta(days=days + more):%Y%m%d%H%M%SZ}" for more in (0, 1)]
    (tmp_path / "ca.cnf").write_text(
        "[ca]\ndefault_ca = c\n[c]\ndatabase = index\nserial = serial\nnew_certs_dir ="
        " .\ndefault_md = sha256\npolicy = any\nx509_extensions = x\n[any]\ncommonName ="
        " optional\n[x]\nsubjectAltName = IP:127.0.0.1\n"
    )
    (tmp_path / "index").touch()
    (tmp_path / "serial").write_text("01\n")
    key = str(certificates / "own.key")
    requested = ["openssl", "req", "-new", "-key", key, "-subj", "/CN=own", "-out", "own.csr"]
    signed = [
        "openssl",
        "ca",
        "-batch",
        "-config",
        "ca.cnf",
        "-selfsign",
        "-keyfile",
        key,
        "-in",
        "own.csr",
        "-startdate",
        stamp[0],
        "-enddate",
        stamp[1],
        "-notext",
        "-out",
        "timed.pem",
    ]
    for command in (requested, signed):
        subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    timed = {kind: str(tmp_path / "timed.pem") for kind in ("ca", "rig_certificate")}
    path = on_line(line_of("tls", **timed))
    with serve(path, None):
        why = connecting(path)
    assert f"its certificate is not trusted ({reason}); check ca, host and both clocks" in why


@pytest.mark.parametrize("shown", ["", r"\1 = '\2other.\3'\n"], ids=["none", "another's"])
def test_a_client_whose_certificate_is_not_trusted_reports_that_as_a_possible_cause(
    serve, on_line, line_of, shown
):
    path = on_line(line_of("tls"))
    with serve(path, None):
        nobody = path.with_name("nobody.toml")
        pattern = r"^(certificate|key) = '(.*)own\.(.*)'\n"
        nobody.write_text(re.sub(pattern, shown, path.read_text(), flags=re.MULTILINE))
        why = connecting(nobody)
    assert re.match(
        r"line leg .*: (the other end closed the line before its first answer, .*does not"
        r" trust|no )",
        why,
    )
    assert "certificate and key" in why


@pytest.mark.parametrize("transport", ["tcp", "rtu_over_tcp", "tls"])
def test_an_unknown_host_is_reported(on_line, transport):
    why = connecting(on_line(f"transport = {transport!r}\nhost = 'no-such-host.invalid'\n"))
    assert "no such host (" in why
    assert why.endswith("correct host in the rig file, or give its address")


def test_a_port_without_tls_is_reported(serve, on_line, line_of):
    path = on_line(line_of("tcp"), connect_s=1.0)
    port = re.search(r"port = (\d+)", path.read_text())[1]
    with serve(path, None):
        assert "no TLS connection" in connecting(
            on_line(f"transport = 'tls'\nport = {port}\n", connect_s=1.0)
        )


def test_a_certificate_that_is_none_is_refused(on_line, tmp_path):
    (tmp_path / "ca.pem").write_text("nonsense")
    why = connecting(on_line("transport = 'tls'\nca = 'ca.pem'\n"))
    assert why.startswith(f"{tmp_path}/ca.pem: is not a usable certificate")


def test_a_key_with_a_passphrase_is_refused_and_nobody_is_asked_for_it(
    on_line, line_of, certificates
):
    locked, expected = (
        str(certificates / "locked.key"),
        f"{certificates}/locked.key: is protected by a passphrase, ",
    )
    assert connecting(on_line(line_of("tls", key=locked))).startswith(expected)
    with pytest.raises(SettingsError) as refused:
        _tls_context(load_rig(on_line(line_of("tls", rig_key=locked))).line["leg"])
    assert str(refused.value).startswith(expected)


def test_a_line_that_does_not_come_back_reads_no_certificates_in_the_middle_of_a_stop(
    on_line, line_of, monkeypatch
):
    rig = load_rig(on_line(line_of("tls")))

    async def come_back():
        line = lines_of(rig)(rig.drive[0])
        monkeypatch.setattr(
            ssl, "create_default_context", lambda **files: pytest.fail("reads files")
        )
        await line.connect()

    with pytest.raises(DeviceError, match=r"^line leg .*: no connection \("):
        asyncio.run(come_back())


def test_what_is_written_to_one_end_of_a_null_modem_comes_out_of_the_other():
    async def talk():
        with (
            null_modem() as (left, right),
            serial.Serial(left) as a,
            serial.Serial(right, timeout=0) as b,
        ):
            for one, other, sent in ((a, b, b"\x01\x03\r\n"), (b, a, b"\x00\xff\x11\x13")):
                other.timeout = 0
                one.write(sent)
                received = b""
                while len(received) < len(sent):
                    await asyncio.sleep(0.01)
                    received += other.read(100)
                assert received == sent

    asyncio.run(asyncio.wait_for(talk(), 20))


def test_a_line_too_slow_for_the_rate_is_refused_before_anything_moves(on_line, line_of, record_on):
    touched = []
    path = on_line(line_of("rtu", baud_rate=9600, silence_s=0.004), shipped="real_time")
    with pytest.raises(SettingsError) as caught:
        record_on(path, "exo_alone", lambda device, function, written: touched.append(function))
    # 52 + 52 characters of two exchanges and 17 of a look at the counter, 10 bits each, and 6 times
    # 4 ms of silence.
    assert 1 / (121 * 10 / 9600 + 0.024) == pytest.approx(6.7, abs=0.05)
    assert (
        str(caught.value)
        == f"{path}: line leg ({path.with_name('port')}): 200 samples a second are asked for, at"
        " most 6 fit through; raise baud_rate, give devices lines of their own, or lower"
        " acquire.sample_rate_hz"
    )
    assert touched == []


@pytest.mark.parametrize(
    ("baud_rate", "silence"),
    [(9600, 3.5 * 11 / 9600), (19200, 3.5 * 11 / 19200), (38400, 0.00175), (921600, 0.00175)],
)
def test_silence_is_what_the_standard_says_where_the_rig_file_says_nothing(baud_rate, silence):
    line = RtuLine(transport="rtu", serial_port="x", baud_rate=baud_rate)
    assert line.quiet_s == pytest.approx(silence)
    assert line.exchange_s(0) == pytest.approx(2 * silence)


class Slow:
    """A device behind a serial device server: its n-th answer's words are all n, and come after
    ``delays[n]``."""

    def __init__(self, *delays):
        self.delays, self.asked, self.writers = delays, 0, []

    async def serve(self, reader, writer):
        self.writers.append(writer)
        while request := await reader.read(1000):
            count = int.from_bytes(request[4:6], "big")
            body = request[:2] + bytes([2 * count]) + self.asked.to_bytes(2, "big") * count
            delay, self.asked = self.delays[self.asked], self.asked + 1
            reply = body + FramerRTU.compute_CRC(body).to_bytes(2, "big")
            asyncio.get_running_loop().call_later(delay, writer.write, reply)

    def at_work(self, ask, reply_s=0.4):
        """Return what ``ask(device)`` finds on a line that such a device is on."""

        async def run():
            server = await asyncio.start_server(self.serve, "127.0.0.1", 0)
            port = server.sockets[0].getsockname()[1]
            line = Line(RtuOverTcpLine(transport="rtu_over_tcp", port=port), 5.0, "leg")
            await line.connect()
            try:
                return await ask(
                    Device(
                        "sensor thigh_front",
                        11,
                        line,
                        SafetySettings(watchdog_s=5.0, reply_s=reply_s),
                    )
                )
            finally:
                line.close()
                server.close()
                for writer in self.writers:
                    writer.transport.abort()
                await asyncio.sleep(0.05)  # what was aborted is closed by then

        return asyncio.run(run())


def test_a_reply_that_comes_too_late_on_a_serial_line_is_not_taken_for_the_next_ones():
    async def ask(device):
        answers = []
        for count in (4, 4, 7, 4):
            try:
                answers.append(await device.read(100, count, in_motion=True))
            except Unanswered:
                answers.append(None)
        return answers

    # Without waiting for it, the second would get [0, 0, 0, 0], and the third be refused for
    # its length.
    assert Slow(0.55, 0.0, 0.0, 0.0).at_work(ask) == [None, [1] * 4, [2] * 7, [3] * 4]
    assert Slow(0.0, 0.55, 0.0, 0.0).at_work(ask) == [[0] * 4, None, [2] * 7, [3] * 4]


def test_a_line_is_renewed_only_where_it_failed_and_nobody_is_asked_in_between():
    async def ask(device):
        line, opened = device.line, []
        connect = line.client.connect

        async def slowly():
            opened.append(line.client.connected)
            await asyncio.sleep(0.2)
            return await connect()

        line.client.connect = slowly
        await line.renew()
        assert not opened  # all that was asked was answered
        with pytest.raises(Unanswered):
            await device.read(100, 1, in_motion=True)
        # The neighbour on the line, whose turn comes while it is renewed.
        _, values = await asyncio.gather(line.renew(), device.read(100, 2))
        return opened, values

    assert Slow(9.0, 0.0).at_work(ask) == ([False], [1, 1])


def test_whoever_has_the_turn_on_a_line_keeps_it_for_all_that_is_asked_within():
    async def ask(device):
        drive = Device("drive knee", 2, device.line, SafetySettings(watchdog_s=5.0, reply_s=0.4))

        async def twice():
            async with drive.turn():
                first = await drive.read(100, 1)
                await asyncio.sleep(0.1)
                return first, await drive.read(100, 1)

        return await asyncio.gather(device.read(100, 1), twice(), device.read(100, 1))

    assert Slow(0.2, 0.1, 0.1, 0.0).at_work(ask) == [[0], ([1], [2]), [3]]


def test_who_waited_for_a_turn_and_had_nothing_to_ask_is_not_waited_for():
    async def ask(device):
        drive = Device("drive knee", 2, device.line, SafetySettings(watchdog_s=5.0, reply_s=0.4))
        async with drive.turn():
            pass
        await asyncio.sleep(0.1)
        return drive.awaited_s

    assert Slow().at_work(ask) == 0.0
