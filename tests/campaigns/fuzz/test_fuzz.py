"""A few seconds of `make fuzz`, and by hand the replies that pymodbus would take for right."""

import asyncio
import re
from dataclasses import replace

import pytest
from pymodbus.framer import FramerRTU
from pymodbus.pdu import DecodePDU

from pipelines.acquisition.modbus.reply import ReplyDecoder
from pipelines.errors import DeviceError
from tests.campaigns.fuzz import replies, requests
from tests.campaigns.fuzz.frames import Frame

SEED = 20261121
INPUTS = 200
READ_14 = b"\x03\x1c" + bytes(28)


def test_hostile_replies_are_refused_in_one_line_and_never_taken_for_right():
    outcome = asyncio.run(replies.fuzz(SEED, INPUTS))
    assert not outcome.failures
    assert outcome.inputs >= INPUTS and outcome.counts["refused"] and outcome.counts["accepted"]


def test_hostile_requests_leave_the_rig_serving_whoever_asks_politely():
    outcome = requests.fuzz(SEED, INPUTS)
    assert not outcome.failures
    assert outcome.inputs >= INPUTS and outcome.counts["refused"] and outcome.counts["answered"]


@pytest.fixture
def answered():
    """Read 14 registers from a hip drive whose answer is changed; returns the error."""

    def read(change):
        async def asking():
            client = replies.Client(replies.hostile_rigs()[0])
            await client.open()
            client.peer.answer = lambda request: [
                bytes(change(Frame(request.transaction, 1, READ_14)))
            ]
            try:
                return await client.machine.drives[0].device.read(100, 14)
            finally:
                await client.end()

        return asyncio.run(asking())

    return read


def test_the_right_reply_is_taken(answered):
    assert answered(lambda frame: frame) == [0] * 14


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"transaction": 0}, "with transaction 0, expected "),
        ({"body": b"\x10\x00\x64\x00\x0e"}, "with function 16, expected 3"),
        ({"body": b"\x97\x02"}, "with function 151, expected 3"),
        ({"body": b"\x2b\x0e\x01"}, "with function 43, which was not asked for"),
        ({"body": READ_14 + b"\x00\x00"}, "with 32 bytes that do not fit function 3"),
        ({"body": b"\x03\x1d" + bytes(29)}, "with 31 bytes that do not fit function 3"),
        ({"body": b"\x83\x02\x00"}, "with 3 bytes that do not fit function 131"),
        ({"body": b"\x03\x1a" + bytes(26)}, "with 13 registers, expected 14"),
        ({"body": b"\x83\xc8"}, "with Modbus exception 200; "),
        ({"unit": 2}, "answered under unit 2"),
        ({"protocol": 1}, "that are no frame"),
    ],
)
def test_a_reply_that_is_none_is_refused_by_what_is_wrong_with_it(answered, change, message):
    with pytest.raises(DeviceError, match=f"drive hip .*{re.escape(message)}"):
        answered(lambda frame: replace(frame, **change))


def test_a_write_is_done_when_what_was_written_is_confirmed():
    async def writing():
        client = replies.Client(replies.hostile_rigs()[0])
        await client.open()
        drive = client.machine.drives[0]
        try:
            await drive.device.write(drive.write_block, [1, 2, 3])
            client.peer.answer = lambda request: [
                bytes(replace(request, length=None, body=b"\x10\x00\xc8\x00\x02"))
            ]
            await drive.device.write(drive.write_block, [1, 2, 3])
        finally:
            await client.end()

    with pytest.raises(DeviceError, match="2 registers written at 200, expected 3 at 200"):
        asyncio.run(writing())


def test_a_queue_is_read_whole_on_a_serial_line():
    # pymodbus's own decoder waits for the end of a shorter frame, and finds no valid CRC there.
    body = bytes.fromhex("18 00 06 00 02 01 b8 12 84")  # the specification's example of FC24
    framer = FramerRTU(ReplyDecoder())
    frame = framer.encode(body, 1, 0)
    used, reply = framer.handleFrame(frame, 1, 0)
    assert (used, reply.values) == (len(frame), [440, 4740])
    assert FramerRTU(DecodePDU(False)).handleFrame(frame, 1, 0)[1] is None
