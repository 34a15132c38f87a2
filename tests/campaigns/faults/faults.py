"""Everything that can befall a frame, a connection or a device between exoid and the drives, by
name."""

import struct
from collections.abc import Iterable
from dataclasses import dataclass, field

from tests.campaigns.faults.proxy import Fault, Frame, Late, Link, RtuFrame, TcpFrame

EXCHANGE = 23
HIP, KNEE, CUFF = 1, 2, 11
"""Unit ids in the rig file."""
SEQUENCE, TIME, ANGLE, VELOCITY, CURRENT = (slice(2 * k, 2 * k + 2) for k in range(5))
"""Where the drive's block has its registers, in words."""
FORCES = slice(2, 8)

REPLY_S, WATCHDOG_S = 0.25, 0.9
BEGINS = 70
"""The exchange of the hip with which a fault begins."""


@dataclass
class From:
    """A fault that begins with the n-th exchange, and befalls so many frames from then on."""

    befall: Fault
    replies: bool = True
    times: float = 1
    unit: int = HIP
    seen: int = 0

    def __call__(self, frame: Frame, link: Link) -> Iterable[bytes | Late]:
        self.seen += frame.unit == HIP and frame.function == EXCHANGE and not frame.is_reply
        ours = frame.unit == self.unit and frame.is_reply == self.replies and _is_a_sample(frame)
        if self.seen < BEGINS or not ours or self.times <= 0:
            return [frame.raw]
        self.times -= 1
        return self.befall(frame, link)


def _is_a_sample(frame: Frame) -> bool:
    """Tell whether a frame asks for a device's block or brings it; a status word alone is none."""
    return frame.function == EXCHANGE or (
        frame.function == 3 and (not frame.is_reply or len(frame.words) >= 8)
    )


ALWAYS = float("inf")


def nothing(frame: Frame, link: Link) -> list[bytes]:
    return [frame.raw]


def lose(frame: Frame, link: Link) -> list[bytes]:
    return []


def delay(seconds: float) -> Fault:
    return lambda frame, link: [Late(frame.raw, seconds)]


def twice(frame: Frame, link: Link) -> list[bytes]:
    return [frame.raw, frame.raw]


def cut(frame: Frame, link: Link) -> list[bytes]:
    return [frame.raw[:-5]]


def another_unit(frame: Frame, link: Link) -> list[bytes]:
    return [frame.with_body(b"\x07" + frame.body[1:])]


def another_function(frame: Frame, link: Link) -> list[bytes]:
    return [frame.with_body(frame.body[:1] + b"\x03" + frame.body[2:])]


def garble(frame: Frame, link: Link) -> list[bytes]:
    """Flip a bit on the line, which a checksum would detect."""
    middle = len(frame.raw) // 2
    return [frame.raw[:middle] + bytes([frame.raw[middle] ^ 4]) + frame.raw[middle + 1 :]]


def noise(frame: Frame, link: Link) -> list[bytes]:
    """Put bytes before a frame that nobody sent."""
    return [b"\x00\xff\x5a" + frame.raw]


def head(place: int, new: bytes) -> Fault:
    return lambda frame, link: [frame.with_head(place, new)]


def other_transaction(frame: TcpFrame, link: Link) -> list[bytes]:
    return [frame.with_head(0, (frame.transaction + 1).to_bytes(2, "big"))]


def longer(frame: TcpFrame, link: Link) -> list[bytes]:
    return [frame.with_head(4, (len(frame.raw) + 40).to_bytes(2, "big"))]


def refuse(code: int) -> Fault:
    def exception(frame: Frame, link: Link) -> list[bytes]:
        return [frame.with_body(bytes([frame.unit, frame.function | 0x80, code]))]

    return exception


def flip(word: int, bit: int) -> Fault:
    def flipped(frame: Frame, link: Link) -> list[bytes]:
        words = frame.words
        words[word] ^= 1 << bit
        return [frame.with_words(words)]

    return flipped


def add(place: slice, counts: int) -> Fault:
    """Step an unsigned 32-bit register."""

    def stepped(frame: Frame, link: Link) -> list[bytes]:
        words = frame.words
        value = ((words[place][0] << 16 | words[place][1]) + counts) % 2**32
        words[place] = [value >> 16, value & 0xFFFF]
        return [frame.with_words(words)]

    return stepped


def another_master(away_rad: float) -> Fault:
    """Let a drive hold another set-point than it was sent, as after another program's write."""

    def written_over(frame: Frame, link: Link) -> list[bytes]:
        if frame.function != EXCHANGE:
            return [frame.raw]
        words = frame.written
        counts = int.from_bytes(struct.pack(">2H", *words[:2]), "big", signed=True) + round(
            1e6 * away_rad
        )
        other = struct.pack(">i", counts)
        return [frame.with_body(frame.body[:11] + other + frame.body[15:])]

    return written_over


def swap(place: slice) -> Fault:
    """Turn the words of every 32-bit register of a stretch round."""

    def swapped(frame: Frame, link: Link) -> list[bytes]:
        words = frame.words
        pairs = [words[place][k : k + 2][::-1] for k in range(0, place.stop - place.start, 2)]
        words[place] = [word for pair in pairs for word in pair]
        return [frame.with_words(words)]

    return swapped


def half_open(frame: Frame, link: Link) -> list[bytes]:
    link.dead = True
    return []


def drop(frame: Frame, link: Link) -> list[bytes]:
    link.drop()
    return []


@dataclass
class Freeze:
    """Registers that stand still from the first frame on that is befallen."""

    place: slice
    held: list[int] = field(default_factory=list)

    def __call__(self, frame: Frame, link: Link) -> list[bytes]:
        words = frame.words
        self.held = self.held or words[self.place]
        words[self.place] = self.held
        return [frame.with_words(words)]


@dataclass
class Reorder:
    """A reply that comes after the next one."""

    held: bytes = b""

    def __call__(self, frame: Frame, link: Link) -> list[bytes]:
        if not self.held:
            self.held = frame.raw
            return []
        return [frame.raw, self.held]


@dataclass
class Restart:
    """A device that loses its connections and restarts its counter and its clock."""

    seen: list[int] = field(default_factory=list)

    def __call__(self, frame: Frame, link: Link) -> list[bytes]:
        if not self.seen:
            self.seen = frame.words
            link.drop()
            return []
        words = frame.words
        words[:4] = [0, 7, 0, 7]
        return [frame.with_words(words)]


@dataclass(frozen=True)
class Case:
    """A fault, and what it is to do to a run."""

    name: str
    fault: Fault
    stops: str | None = None
    """Words of the reason; None where the run goes on."""
    run: str = "exo_alone"
    gap: bool = False
    """Whether samples are missing then."""
    either: bool = False
    """Whether it may go on too: what a device makes of half a request nobody can know."""
    frames: type[Frame] = Frame
    """Which it befalls: of all kinds, or those that have what it damages."""


def cases(frames: type[Frame]) -> list[Case]:
    """Return the faults of a kind of frame, new ones at each call: they remember what they have
    seen."""
    everything = [
        Case("none", nothing),
        Case("a reply is lost", From(lose), gap=True),
        Case("a request is lost", From(lose, replies=False), gap=True),
        Case("a reply is late, within reply_s", From(delay(0.3 * REPLY_S))),
        Case("a reply is late, after reply_s", From(delay(1.3 * REPLY_S)), gap=True),
        Case("every reply is lost", From(lose, times=ALWAYS), "did not answer an exchange"),
        Case(
            "every reply is later than the watchdog",
            From(delay(2 * WATCHDOG_S), times=ALWAYS),
            "did not answer",
        ),
        Case("a cuff sensor's reply is lost", From(lose, unit=CUFF), run="with_human"),
        Case(
            "a cuff sensor's replies are all lost",
            From(lose, unit=CUFF, times=ALWAYS),
            "sensor thigh_front",
            run="with_human",
        ),
        Case("the knee's replies are all lost", From(lose, unit=KNEE, times=ALWAYS), "drive knee"),
        Case("a reply is duplicated", From(twice)),
        Case("a request is duplicated", From(twice, replies=False)),
        Case("every reply is duplicated", From(twice, times=ALWAYS)),
        Case("two replies are reordered", From(Reorder(), times=2), gap=True),
        Case("a reply is truncated", From(cut), gap=True),
        Case("a request is truncated", From(cut, replies=False), "", either=True),
        Case(
            "a reply has another transaction id", From(other_transaction), gap=True, frames=TcpFrame
        ),
        Case(
            "every reply has another transaction id",
            From(other_transaction, times=ALWAYS),
            "answered with transaction",
            frames=TcpFrame,
        ),
        Case(
            "a reply has transaction id 0",
            From(head(0, b"\0\0")),
            "transaction 0, expected",
            frames=TcpFrame,
        ),
        Case("a reply has another unit id", From(another_unit), gap=True),
        Case(
            "a reply has another protocol id", From(head(2, b"\x12\x34")), gap=True, frames=TcpFrame
        ),
        Case("a reply has a wrong length", From(longer), gap=True, frames=TcpFrame),
        Case("a reply has another function", From(another_function), "function 3, expected 23"),
        Case("exception reply 4, device failure", From(refuse(4)), "Modbus exception 4: it failed"),
        Case(
            "exception reply 6, device busy",
            From(refuse(6)),
            "it is busy (server device busy); stop other programs",
        ),
        Case("a bit of the counter is flipped", From(flip(1, 1)), "counter"),
        Case("a high bit of the counter is flipped", From(flip(0, 4)), "counter"),
        Case("a bit of the clock is flipped", From(flip(2, 1)), "its clock went"),
        Case("a bit of the angle is flipped", From(flip(5, 14)), "its angle"),
        Case("a high bit of the angle is flipped", From(flip(4, 12)), "is outside its limits"),
        Case("a bit of the speed is flipped", From(flip(6, 2)), "speed"),
        Case("a high bit of the current is flipped", From(flip(8, 5)), "torque"),
        Case("the connection is half open", From(half_open), "drive hip"),
        Case("the connection is dropped", From(drop), "hip"),
        Case("the device restarts", From(Restart(), times=ALWAYS), "hip"),
        Case("the counter is stuck", From(Freeze(SEQUENCE), times=ALWAYS), "stands still"),
        Case("the whole block is frozen", From(Freeze(slice(0, 14)), times=ALWAYS), "stands still"),
        Case(
            "the angle's register is frozen",
            From(Freeze(ANGLE), times=ALWAYS),
            "its register is frozen",
        ),
        Case(
            "angle and speed are frozen",
            From(Freeze(slice(4, 8)), times=ALWAYS),
            "its register is frozen",
        ),
        Case(
            "the current's register is frozen",
            From(Freeze(CURRENT), times=ALWAYS),
            "its register is frozen",
        ),
        Case(
            "a cuff sensor's forces are frozen",
            From(Freeze(FORCES), unit=CUFF, times=ALWAYS),
            "are frozen",
            run="with_human",
        ),
        Case(
            "a cuff sensor restarts its counter",
            From(add(SEQUENCE, -100), unit=CUFF, times=ALWAYS),
            "its sample counter went back",
            run="with_human",
        ),
        Case("the angle's words are swapped half way", From(swap(ANGLE), times=ALWAYS), "angle"),
        Case(
            "the current's words are swapped half way", From(swap(CURRENT), times=ALWAYS), "torque"
        ),
        Case(
            "another master writes a set-point 0.4 rad away",
            From(another_master(0.4), replies=False),
            "hip torque",
        ),
        Case(
            "another master writes set-points 5 mrad away, again and again",
            From(another_master(0.005), replies=False, times=ALWAYS),
        ),
        Case(
            "the clock steps forward by 1 s",
            From(add(TIME, 1_000_000), times=ALWAYS),
            "by its own clock",
        ),
        Case(
            "the clock steps back by 1 s",
            From(add(TIME, -1_000_000), times=ALWAYS),
            "its clock went from",
        ),
        Case(
            "the knee's clock steps forward by 20 ms",
            From(add(TIME, 20_000), unit=KNEE, times=ALWAYS),
            "one of the two leapt",
        ),
        Case("a bit of a reply is flipped on the line", From(garble), gap=True, frames=RtuFrame),
        Case(
            "a bit of a request is flipped on the line",
            From(garble, replies=False),
            gap=True,
            frames=RtuFrame,
        ),
        Case("noise comes before a reply", From(noise), frames=RtuFrame),
    ]
    return [case for case in everything if issubclass(frames, case.frames)]
