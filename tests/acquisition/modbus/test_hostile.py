"""Devices as they are sold: what they do that is harmless is served, the rest is named."""

import asyncio
import errno
import re
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.line import Line
from pipelines.acquisition.modbus.one_client import greet
from pipelines.acquisition.modbus.unexpected import SentRequest, described
from pipelines.errors import DeviceError, Unanswered
from pipelines.modbus.register_block import Block
from pipelines.settings.rig import Register
from pipelines.settings.rig.line import RtuOverTcpLine, TcpLine
from pipelines.settings.rig.safety import SafetySettings
from tests.acquisition.modbus.hostile import in_rtu, in_tcp, serving

SAFETY = SafetySettings(connect_s=0.2, watchdog_s=0.9)


def device_on(port, unit=1, rtu=False, connect_s=0.2):
    settings = RtuOverTcpLine(transport="rtu_over_tcp", port=port) if rtu else TcpLine(port=port)
    safety = SAFETY.model_copy(update={"connect_s": connect_s})
    return Device("drive hip", unit, Line(settings, 0.5), safety)


def asked_of(ask, *arguments, rtu=None, unit=1, connect_s=0.2, **options):
    """Return what ``ask(device)`` returns, the server and the line; ``rtu`` is for both ends."""

    async def run():
        async with serving(*arguments, rtu=rtu, **options) as (server, port):
            device = device_on(port, unit, rtu is not None, connect_s)
            await device.line.connect()
            try:
                return await ask(device), server, device.line
            finally:
                device.line.close()

    return asyncio.run(run())


@pytest.mark.parametrize(
    ("manner", "words"),
    [
        ("unit 0", "answered under unit 0, asked unit 1 (00 01 00 00 00 05 00 03 02 00 07)"),
        ("swapped", "answered with transaction 0x0100 for 0x0001: its two bytes are swapped"),
        ("raw", 'expected Modbus TCP; set transport = "rtu_over_tcp"'),
        ("garbled", "sent 11 bytes that are no frame (9f 3c 00 ff 8b 1e 77 a0 c4 d2 10); check"),
        ("web", "answered with text ('HTTP/1.1 400 Bad Request'), expected Modbus"),
        ("short", "sent only the first 10 bytes of an answer"),
        ("silent", "did not answer reading register 7 within 0.2 s; check cable and power"),
    ],
)
def test_what_came_in_place_of_an_answer_is_named_by_its_bytes(manner, words):
    with pytest.raises(Unanswered) as caught:
        asked_of(lambda device: device.read(7, 1), manner)
    assert words in str(caught.value)


@pytest.mark.parametrize("unit", [0, 248, 255])
@pytest.mark.parametrize("function", [3, 4])
def test_every_unit_is_reached_on_tcp_by_either_function(unit, function):
    words, server, _ = asked_of(lambda device: device.read(7, 2, function=function), unit=unit)
    assert words == [7, 8]
    assert server.requests == [(unit, function)]


def test_a_reply_of_any_other_unit_is_no_answer_of_unit_0():
    # pymodbus itself takes every unit for 0.
    asked = SentRequest(in_tcp(1, 0, b"\x03\x00\x07\x00\x01"), 0, 1, 3, False)
    assert "answered under unit 9, asked unit 0" in described(asked, in_tcp(1, 9, b"\x03\x02\0\7"))


@pytest.mark.parametrize("slow", [0.0, 0.002])
@pytest.mark.parametrize("rtu", ["plain", "echo"])
def test_the_echo_of_an_adapter_is_passed_over_however_it_comes(rtu, slow):
    block = Block({"control": Register(address=5, type="uint16")})

    async def ask(device):
        # At 0x0602 the address begins as the answer's byte count does.
        words = [await device.read(7, 3), await device.read(0x0602, 3, function=4)]
        await device.write(block, [12])
        await device.write(block, [12], function=6)  # its answer equals the request
        return [*words, await device.read(9, 1)]

    words, server, line = asked_of(ask, rtu=rtu, slow=slow, connect_s=2.0)
    assert words == [[7, 8, 9], [0x0602, 0x0603, 0x0604], [9]]
    assert [function for _, function in server.requests] == [3, 4, 16, 6, 3]
    assert [("sends back each request" in note) for note in line.peculiarities] == (
        [True] if rtu == "echo" else []
    )


def test_an_adapter_that_echoes_without_a_device_behind_it_is_named():
    with pytest.raises(Unanswered, match="sent back the request itself"):
        asked_of(lambda device: device.read(7, 1), rtu="dead")


@pytest.mark.parametrize("seconds", [0.0, 0.05])
def test_a_server_that_closes_after_each_answer_is_served_and_named(seconds):
    async def ask(device):
        words = []
        for address in range(5):
            words += await device.read(address, 1)
            await asyncio.sleep(seconds)  # the end of the connection may come before the request
        return words

    words, server, line = asked_of(ask, closes=True)
    assert words == [0, 1, 2, 3, 4]
    assert len(server.requests) == server.connections == 5
    assert "closes its connection after each answer" in line.peculiarities[0]


async def ask_three_times(device, before_the_third=lambda transport: None):
    await device.read(0, 1)
    await device.read(0, 1)
    before_the_third(device.line.client.ctx.transport)
    await asyncio.sleep(0.02)
    await device.read(0, 1)


@pytest.mark.parametrize("reset", [False, True])
def test_a_device_that_closes_the_connection_after_several_answers_is_named_as_that(reset):
    expected = "the line is lost: the device closed the connection; end other programs that use it"
    with pytest.raises(DeviceError, match=expected) as caught:
        asked_of(ask_three_times, answers=2, reset=reset)
    assert not isinstance(caught.value, Unanswered)


def test_a_connection_that_ends_while_it_is_opened_is_named_without_waiting_for_an_answer():
    # As of a server that serves one client, and has another.
    async def ask(device):
        client = device.line.client
        device.line.close()
        connect = client.connect

        async def and_lose():
            is_open = await connect()
            transport = client.ctx.transport
            transport.close()
            await asyncio.sleep(0.02)
            # As pymodbus leaves it where the end comes before its own `connect` goes on.
            client.ctx.transport = transport
            return is_open

        client.connect = and_lose
        await device.line.connect()
        await device.read(7, 1)

    began = time.monotonic()
    with pytest.raises(DeviceError, match=r"without an answer.* no other program uses it") as why:
        asked_of(ask, connect_s=3.0)
    assert time.monotonic() - began < 2.0
    assert not isinstance(why.value, Unanswered)


def test_a_connection_that_the_system_gives_up_sends_the_user_to_cable_and_power():
    def give_up(transport):
        # As the system does where a cable is pulled and nothing comes back for long.
        transport._fatal_error(TimeoutError(errno.ETIMEDOUT, "Connection timed out"))

    with pytest.raises(DeviceError, match=r"lost \(.*timed out\); check cable and power"):
        asked_of(lambda device: ask_three_times(device, give_up))


@pytest.mark.parametrize("newest", [False, True])
def test_devices_behind_a_server_of_one_client_share_a_connection(newest):
    async def run():
        async with serving(clients=1, newest=newest) as (_, port):
            devices = [device_on(port, unit) for unit in (1, 2, 3)]
            for k, device in enumerate(devices):
                await greet(device, devices[:k], lambda device=device: device.read(5, 1))
                await asyncio.sleep(0.02)
            words = [await device.read(7, 1) for device in devices]
            lines = {device.line for device in devices}
            for line in lines:
                line.close()
            return words, lines

    words, lines = asyncio.run(run())
    assert words == [[7], [7], [7]]
    assert len(lines) == 1
    assert "serves one client" in lines.pop().peculiarities[0]


def test_a_fault_that_no_server_of_one_client_makes_is_raised_and_not_passed_over():
    async def run():
        async with serving() as (_, port):
            devices = [device_on(port, unit) for unit in (1, 2)]
            await greet(devices[0], [], lambda: devices[0].read(5, 1))
            own = devices[1].line

            async def answers_nonsense_once():
                if devices[1].line is own:
                    raise DeviceError("nonsense")

            try:
                await greet(devices[1], devices[:1], answers_nonsense_once)
            finally:
                for device in devices:
                    device.line.close()

    with pytest.raises(DeviceError, match="nonsense"):
        asyncio.run(run())


def test_a_silent_device_is_not_helped_by_the_connection_of_another():
    async def run():
        async with serving("silent") as (_, silent), serving() as (_, port):
            first, other = device_on(port), device_on(silent, 2)
            await greet(first, [], lambda: first.read(5, 1))
            with pytest.raises(Unanswered, match=re.escape(f"127.0.0.1:{silent}")):
                await greet(other, [first], lambda: other.read(5, 1))
            first.line.close()
            other.line.close()

    asyncio.run(run())


REQUEST = b"\x03\x00\x07\x00\x01"


@given(st.binary(max_size=40), st.booleans())
def test_any_bytes_are_described_in_one_line(came, rtu):
    frame = in_rtu(1, REQUEST) if rtu else in_tcp(1, 1, REQUEST)
    text = described(SentRequest(frame, 1, 0 if rtu else 1, 3, rtu), came)
    assert (text is None) == (not came)
    assert text is None or "\n" not in text


@given(st.integers(0, 255), st.binary(min_size=2, max_size=20))
def test_an_answer_in_the_other_kind_of_frame_is_always_named_as_one(unit, content):
    pdu = bytes([3, len(content)]) + content
    on_tcp = SentRequest(in_tcp(1, unit, REQUEST), unit, 1, 3, False)
    assert 'set transport = "rtu_over_tcp"' in described(on_tcp, in_rtu(unit, pdu)) or (
        in_rtu(unit, pdu)[2:4] == b"\0\0"  # a content that begins like a TCP frame
    )
    on_rtu = SentRequest(in_rtu(unit, REQUEST), unit, 0, 3, True)
    assert 'set transport = "tcp"' in described(on_rtu, in_tcp(1, unit, pdu))
