"""Requests of a hostile client against the virtual rig, a process of its own, over real sockets."""

from __future__ import annotations

import re
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory, TemporaryFile

import numpy as np

from pipelines.settings import datasets
from tests.campaigns.fuzz.frames import HANG_UP, Frame, Script, mutated, parsed, words
from tests.campaigns.fuzz.outcome import HANG_S, Outcome, peak_mib

REPLY_S = 0.02
"""How long a reply is waited for; to many requests there is none."""
POLITE_EVERY = 50
"""Inputs from one polite question to the next."""
UNITS = (1, 2, 11, 12, 13, 14)
ADDRESSES = (0, 1, 2, 99, 100, 113, 200, 201, 202, 203, 65534, 65535)
IDENTITY = b"\x03\x04\x45\x58\x00\x02"
FUNCTIONS = (1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15, 16, 17, 20, 21, 22, 23, 24, 43)
FLOOD_REQUESTS = 200_000


class Rig:
    """The rig's process, and connections to it."""

    def __init__(self, process: subprocess.Popen, port: int, complaints) -> None:
        self.process, self._port, self._complaints = process, port, complaints
        self._line: socket.socket | None = None

    def line(self) -> socket.socket:
        """Return the connection that inputs are sent on; a new one where the last was given up."""
        if self._line is None:
            self._line = self.connect()
        return self._line

    def connect(self) -> socket.socket:
        """Return a new connection."""
        return socket.create_connection(("127.0.0.1", self._port), timeout=HANG_S)

    def give_up(self) -> None:
        """Close the connection: what the rig makes of a bad frame's rest is not the next input's
        business."""
        if self._line is not None:
            self._line.close()
        self._line = None

    def ask(self, unit: int, body: bytes) -> bytes:
        """Return what a polite client is answered on a connection of its own."""
        with self.connect() as polite:
            polite.sendall(bytes(Frame(7, unit, body)))
            return _received(polite, HANG_S)

    def wrong(self) -> str | None:
        """Return what a polite client finds wrong with the rig, None if it serves as it should."""
        if self.process.poll() is not None:
            return f"the rig has ended with {self.process.returncode}"
        try:
            for unit in (1, 2):
                if not self.ask(unit, struct.pack(">BHH", 3, 0, 2)).endswith(IDENTITY):
                    return f"unit {unit} no longer reports its identity"
                sample = self.ask(unit, struct.pack(">BHH", 3, 100, 14))[9:]
                if len(sample) != 28:
                    return f"unit {unit} no longer reports a sample: {sample.hex()}"
                if not np.isfinite(struct.unpack(">iififff", sample)[2]):
                    return f"unit {unit} stands at an angle that is no number"
        except OSError as error:
            return f"a polite client is not answered: {error!r}"
        self._complaints.seek(0)
        errors = self._complaints.read().decode(errors="replace").strip()
        return f"the rig said {errors[-300:]!r}" if errors else None


@contextmanager
def serving() -> Iterator[Rig]:
    """Serve the plain rig, its set-points and angles floats, as a user would."""
    text = (datasets() / "rigs" / "plain.toml").read_text()
    text = re.sub(
        r'^((angle|reference) = .*)"int32", scale = 1e-6', r'\1"float32"', text, flags=re.MULTILINE
    )
    with TemporaryDirectory() as folder, TemporaryFile() as complaints:
        path = Path(folder) / "rig.toml"
        path.write_text(text)
        command = [
            sys.executable,
            "-m",
            "exoid_cli.app",
            "rig",
            "serve",
            path,
            "--run",
            "with_human",
            "--port",
            "0",
        ]
        with subprocess.Popen(
            [*command, "--until-input-ends"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=complaints,
        ) as process:
            rig = Rig(
                process, int(process.stdout.readline().decode().rpartition(":")[2]), complaints
            )
            try:
                yield rig
            finally:
                rig.give_up()
                process.stdin.close()
                with suppress(subprocess.TimeoutExpired):
                    process.wait(10)
                process.kill()


def request(rng: Random) -> Frame:
    """Return a request that is well formed, as far as its function is one that counts."""
    function = rng.choice((3, 16, 23, 23)) if rng.random() < 0.6 else rng.choice(FUNCTIONS)
    address = rng.choice(ADDRESSES) if rng.random() < 0.9 else rng.randrange(65536)
    count = (
        rng.choice((1, 2, 3, 14, 120, 121, 125, 126))
        if rng.random() < 0.9
        else rng.randrange(65536)
    )
    data = words(rng, min(count, 120))
    if address in (200, 201, 202) and rng.random() < 0.7:  # a set-point, enabled
        address, count, data = 200, 3, words(rng, 2)[:4] + b"\x00\x0f"
    if function in (15, 16):
        rest = struct.pack(">HHB", address, count, len(data)) + data
    elif function == 23:
        rest = struct.pack(">HHHHB", 100, 14, address, count, len(data)) + data
    elif function in (1, 2, 3, 4, 5, 6):
        rest = struct.pack(">HH", address, count)
    else:
        rest = rng.randbytes(rng.randrange(12))
    unit = rng.choice(UNITS) if rng.random() < 0.95 else rng.randrange(256)
    return Frame(rng.randrange(65536), unit, bytes([function]) + rest)


def fuzz(seed: int, inputs: int, only: int | None = None) -> Outcome:
    """Try so many requests; ``only`` one to see it again."""
    outcome = Outcome("requests", seed)
    with serving() as rig:
        before = peak_mib(rig.process.pid)
        transcript: list[str] = []
        for index in range(inputs) if only is None else range(only - POLITE_EVERY, only + 1):
            outcome.inputs += 1
            rng = Random(f"{seed}/{index}")
            frame = request(rng)
            name, script = ("right", [bytes(frame)]) if rng.random() < 0.5 else mutated(rng, frame)
            transcript.append(
                f"{name}: {[s[:300].hex() if isinstance(s, bytes) else s for s in script[:8]]}"
            )
            began = time.perf_counter()
            what, wrong = _sent(rig, frame, name, script)
            if index % POLITE_EVERY == 0 or index == only:
                wrong = wrong or rig.wrong()
            outcome.count(what, time.perf_counter() - began)
            if wrong:
                outcome.fail(index, wrong, transcript[-POLITE_EVERY:])
            if rig.process.poll() is not None:
                break
        if only is None and (wrong := _flooded(rig)):
            outcome.failures.append(wrong)
        outcome.grown_mib = (
            peak_mib(rig.process.pid) - before if rig.process.poll() is None else 0.0
        )
    outcome.check_memory()
    return outcome


def _sent(rig: Rig, frame: Frame, name: str, script: Script) -> tuple[str, str | None]:
    """Send an input; return what came of it, and what is wrong with that."""
    reply = b""
    try:
        for step in script:
            if step is HANG_UP:
                rig.give_up()
            elif isinstance(step, float):
                time.sleep(step)
            else:
                rig.line().sendall(step)
        if name == "right":
            reply = _received(rig.line(), REPLY_S)
    except OSError:  # the rig may hang up on whoever sends such things
        rig.give_up()
        return "hung up", None
    if name != "right" or not reply:
        rig.give_up()
        return "unanswered", None
    reply_frame = parsed(reply)
    kind = "refused" if reply_frame.body[0] & 0x80 else "answered"
    right = (frame.transaction, frame.unit, frame.body[0]) == (
        reply_frame.transaction,
        reply_frame.unit,
        reply_frame.body[0] & 0x7F if frame.body[0] < 0x80 else reply_frame.body[0],
    )
    return kind, None if right else f"{bytes(frame).hex()} was answered {reply.hex()}"


def _received(line: socket.socket, wait_s: float) -> bytes:
    """Return a whole frame, or nothing where none comes."""
    line.settimeout(wait_s)
    data = b""
    with suppress(TimeoutError):
        while len(data) < 7 or len(data) < 6 + int.from_bytes(data[4:6], "big"):
            if not (more := line.recv(4096)):
                break
            data += more
    line.settimeout(HANG_S)
    return data


def _flooded(rig: Rig) -> str | None:
    """Ask for ever without fetching an answer, from one connection; then ask politely, with many
    that are idle."""
    idle = [rig.connect() for _ in range(100)]
    asked = bytes(Frame(1, 1, struct.pack(">BHH", 3, 100, 14)))
    with rig.connect() as greedy, suppress(OSError):
        greedy.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        greedy.settimeout(1.0)
        for _ in range(FLOOD_REQUESTS):
            greedy.sendall(asked)
    wrong = rig.wrong()
    for line in idle:
        line.close()
    return f"after a flood: {wrong}" if wrong else None
