"""Draining a drive's own record: what comes out is what the drive measured, or it is missing."""

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipelines.acquisition.modbus.ring_buffer import FEWEST_READS, Queue, Ring
from pipelines.acquisition.modbus.wraparound import Unwrapper
from pipelines.errors import SettingsError
from pipelines.modbus.register_block import Block
from pipelines.rig import ring as virtual
from pipelines.settings.rig import load_rig
from pipelines.settings.rig.ring import RingSettings

CAPACITY = 64
RECORD = {
    "sequence": {"address": 0, "type": "uint16"},
    "time": {"address": 1, "type": "uint16", "unit": "ms"},
    "angle": {"address": 2, "type": "int32", "scale": 1e-6, "unit": "rad"},
    "current": {"address": 4, "type": "int16", "scale": 10.0, "unit": "mA"},
}
RING = RingSettings.model_validate(
    {
        "newest": {"address": 10, "type": "uint16"},
        "address": 1000,
        "capacity": CAPACITY,
        "words": 8,
        "record": RECORD,
    }
)
QUEUE = RingSettings.model_validate({"fifo": 50, "words": 8, "record": RECORD})


def angle(number):
    """What the drive measured at a sample."""
    return number * 1e-3


class Drive:
    """A virtual drive's ring, which may go on while it is read; answers like a line."""

    def __init__(self, settings, began=0):
        self.ring, self.number = virtual.Ring(settings), began - 1
        self.after_each_read = 0
        self.torn = None
        self.asked = []

    def sample(self, count):
        for _ in range(count):
            self.number += 1
            values = {
                "sequence": self.number % 65536,
                "time": 0.0,
                "angle": angle(self.number),
                "current": 0.0,
            }
            self.ring.append(self.number, values)

    async def read(self, address, count, *, function, in_motion):
        self.asked.append(count)
        if address == RING.newest.address:
            return Block({"newest": RING.newest}).encode({"newest": self.number % 65536})
        registers = [0] * 2000
        self.ring.show(registers, 0, address, count)
        if self.torn is not None:
            registers[self.torn] ^= 1
        self.sample(self.after_each_read)
        return registers[address : address + count]

    async def read_fifo(self, address, words):
        assert address == QUEUE.fifo
        self.asked.append(31)
        return self.ring.take()


def numbered():
    counter = Unwrapper(65536)
    return lambda sequence, sent: int(counter(sequence))


def drained(ring, newest):
    return [
        (number, round(record["angle"], 6)) for number, record in asyncio.run(ring.drain(newest))
    ]


def truth(numbers):
    return [(number, round(angle(number), 6)) for number in numbers]


@pytest.mark.parametrize("began", [0, 65530])
def test_every_sample_comes_once_and_in_order_also_where_ring_and_counter_wrap(began):
    drive = Drive(RING, began)
    drive.sample(1)
    ring, records, number = Ring(drive, RING, numbered()), [], numbered()
    number(began, None)
    ring._note_newest(began, None)
    drained(ring, began)
    for _ in range(40):
        drive.sample(7)
        records += drained(ring, drive.number)
    assert records == truth(range(began + 1, began + 281))


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 150), st.integers(0, 20)), min_size=1, max_size=30))
def test_what_was_overwritten_before_or_while_it_was_read_is_missing_and_never_wrong(steps):
    drive = Drive(RING)
    drive.sample(1)
    ring, records = Ring(drive, RING, numbered()), []
    drained(ring, 0)
    for count, meanwhile in steps:
        drive.sample(count)
        drive.after_each_read = meanwhile
        records += drained(ring, drive.number)
    numbers = [number for number, _ in records]
    assert numbers == sorted(set(numbers))
    assert records == truth(numbers)


def test_nothing_is_missing_while_the_ring_is_drained_before_it_is_full():
    drive = Drive(RING)
    drive.sample(1)
    ring, records = Ring(drive, RING, numbered()), []
    drained(ring, 0)
    drive.after_each_read = 1
    for _ in range(30):
        drive.sample(20)
        records += drained(ring, drive.number)
    assert [number for number, _ in records] == list(range(1, records[-1][0] + 1))
    assert records[-1][0] > 500


def test_a_drain_takes_no_longer_than_a_few_reads_of_125_registers():
    drive = Drive(RING)
    drive.sample(1)
    ring = Ring(drive, RING, numbered())
    drained(ring, 0)
    drive.sample(60)
    drive.asked.clear()
    drained(ring, drive.number)
    assert len(drive.asked) <= FEWEST_READS + 1
    assert max(drive.asked) <= 125


def test_a_record_with_another_number_than_its_place_says_is_read_again_and_then_left_out():
    drive = Drive(RING)
    drive.sample(1)
    ring = Ring(drive, RING, numbered())
    drained(ring, 0)
    drive.sample(5)
    drive.torn = RING.address + 3 * RING.words  # the number of record 3
    assert drained(ring, 5) == truth([1, 2])
    assert drained(ring, 5) == truth([4, 5])


def test_a_record_that_was_counted_before_it_was_written_is_not_lost():
    drive = Drive(RING)
    drive.sample(1)
    ring = Ring(drive, RING, numbered())
    drained(ring, 0)
    drive.sample(2)
    assert drained(ring, 3) == truth([1, 2])  # 3 is announced, its place still holds an older one
    drive.sample(1)
    assert drained(ring, 3) == truth([3])


def test_a_queue_is_emptied_and_what_it_lost_is_missing():
    drive = Drive(QUEUE)
    drive.sample(3)
    queue = Queue(drive, QUEUE)
    assert drained(queue, 2) == []
    drive.sample(8)
    assert drained(queue, 10) == truth(range(3, 11))
    drive.sample(2)
    drive.ring.take()  # an answer that never came
    drive.sample(1)
    assert drained(queue, 13) == truth([13])


def test_a_queue_of_short_reads_is_emptied_at_twenty_samples_a_set_point():
    drive = Drive(QUEUE)
    drive.sample(1)
    queue, records = Queue(drive, QUEUE, samples_per_cycle=20), []
    drained(queue, 0)
    for _ in range(50):
        drive.sample(20)
        records += drained(queue, drive.number)
    assert records == truth(range(1, 1001))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "capacity = 2048",
            "capacity = 2000",
            "an unsigned counter and a power of 2",
        ),
        ("capacity = 2048", "capacity = 16384", "such a ring ends beyond address 65535"),
        (
            "words = 10",
            "words = 9",
            "words: found 9, but the record's registers take 10; correct one",
        ),
        (
            "newest = { address = 120",
            "newest = { address = 1010",
            "newest: register 1010 is part of the ring itself",
        ),
        (
            "newest = { address = 120",
            "newest = { address = 999",
            "newest: register 999 is part of the ring itself",
        ),
        (
            "capacity = 2048",
            "fifo = 50",
            "expected newest, address and capacity (a ring that FC03 reads), or fifo",
        ),
        (
            "record_rate_hz = 1000.0",
            "",
            'record_rate_hz: missing; sampling = "recorder" needs the rate',
        ),
    ],
)
def test_a_ring_that_cannot_be_is_refused_with_its_key(rig_file, old, new, words):
    with pytest.raises(SettingsError) as caught:
        load_rig(rig_file("recorder", replace={old: new}))
    assert words in str(caught.value)


def test_a_set_point_rate_that_does_not_divide_the_rings_is_refused(rig_file):
    with pytest.raises(
        SettingsError,
        match="record_rate_hz: found 1000 with set-points at 300 Hz, expected a whole",
    ):
        load_rig(rig_file("recorder")).samples_per_cycle(300.0)


def test_a_ring_that_is_overwritten_from_one_set_point_to_the_next_is_refused(rig_file):
    small = rig_file("recorder", replace={"capacity = 2048": "capacity = 16"})
    assert load_rig(small).samples_per_cycle(200.0) == 5
    with pytest.raises(
        SettingsError,
        match=r"ring\.capacity: found 16 with 10 records from one set-point to the next",
    ):
        load_rig(small).samples_per_cycle(100.0)
