"""The virtual rig as Modbus devices: drives and force sensors, all latched at one instant.

In lockstep a cycle (one sample, or those of a ring from one set-point to the next) lasts until
there was one exchange with every drive (FC23: set-point in, sample out). So a run depends only on
seeds and set-points. In real time the samples follow the rig's clock, or each drive's own.
"""

import asyncio
import gc
import logging
import os
import signal
import sys
import threading
from collections import defaultdict
from collections.abc import Callable, Iterable
from contextlib import AsyncExitStack, suppress
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pymodbus.constants import ExcCodes
from pymodbus.simulator import DataType, SimData, SimDevice

from pipelines.errors import SettingsError, about
from pipelines.mechanics.motion import CUFFS
from pipelines.modbus.register_block import Block
from pipelines.process.event_loop import exact_event_loop
from pipelines.rig.clocks import OwnClock
from pipelines.rig.listening import listening
from pipelines.rig.plant import JOINTS, Plant, Samples
from pipelines.rig.ring import Ring, fifo_request
from pipelines.rig.sealed import hidden_effects
from pipelines.rig.servo import Servo
from pipelines.rig.stop_signals import set_on_signals
from pipelines.settings.rig import RigSettings, load_rig
from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.devices import DriveSettings, SensorSettings
from pipelines.settings.rig.line import LineSettings, RtuLine, TcpLine
from pipelines.settings.rig.register_map import DriveMap, Identity, SensorMap

Announce = Callable[[str, str | None], None]
"""Called with an address and the name of its line; None for devices that are on no line."""

READ_WRITE = 23
"""Function code of the exchange that ends a cycle in lockstep."""


def build_plant(
    rig: RigSettings, path: Path, run: str, seed: int = 0, sample_rate_hz: float | None = None
) -> Plant:
    """Return the plant of a rig file with its hidden effects, for a rate of set-points.

    Raises
    ------
    SettingsError
        The file has no ``[plant]``.
    """
    if rig.plant is None:
        raise SettingsError(
            f"{path}: plant: missing, so there is no machine to simulate; add a [plant], see"
            " docs/rig.md"
        )
    hidden = hidden_effects(path.parent / rig.plant.sealed) if rig.plant.sealed else ()
    cycle_hz = sample_rate_hz or rig.plant.sample_rate_hz
    with about(path):
        device_hz = cycle_hz * rig.samples_per_cycle(cycle_hz)
        finer = 1
        if any(rig.plant.clock_ppm):
            # Devices then sample between the plant's samples, which must be close to interpolate.
            finer = max(1, round(rig.plant.drive_rate_hz / device_hz))
        return Plant(rig.plant, run, seed, hidden, device_hz * finer)


class Device:
    """Registers of one device, filled at each request with the sample that is latched then."""

    def __init__(
        self, rig: "VirtualRig", unit: int, identity: Iterable[Identity], blocks: Iterable[Block]
    ) -> None:
        self.rig = rig
        self.unit = unit
        self.identity = tuple(identity)
        self.blocks = tuple(blocks)
        self.registers: list[int] = []
        """The device's words from address ``first`` on, shared with the server."""
        self.first = 0
        self.written = False
        """Whether it was written to since the last sample."""

    def as_served(self) -> SimDevice:
        """Return the device for the server."""
        held = {entry.address: entry.value for entry in self.identity}
        for span in self.spans():
            held |= dict.fromkeys(span, 0)
        # One SimData for each stretch of addresses; registers in between do not exist.
        stretches = groupby(enumerate(sorted(held)), lambda numbered: numbered[1] - numbered[0])
        addresses = [[address for _, address in stretch] for _, stretch in stretches]
        data = [
            SimData(a[0], values=[held[i] for i in a], datatype=DataType.REGISTERS)
            for a in addresses
        ]
        return SimDevice(self.unit, simdata=data, action=self._serve)

    def spans(self) -> tuple[range, ...]:
        """Return the addresses of its registers, except those of its identity."""
        return tuple(range(block.address, block.address + block.count) for block in self.blocks)

    async def _serve(
        self,
        function: int,
        first: int,
        address: int,
        count: int,
        registers: list[int],
        written: list | None,
    ) -> ExcCodes | None:
        self.registers, self.first = registers, first
        if written is not None and not self.takes(address, count):
            return ExcCodes.ILLEGAL_ADDRESS
        self.rig.catch_up()  # with the old set-point, before a write takes effect
        self.written |= written is not None
        if written is None:
            self.show(self.latched())
            self.show_records(address, count)
            if function == READ_WRITE:
                self.rig.exchanged(self)
        return None

    def takes(self, address: int, count: int) -> bool:
        """Return whether registers may be written; those that are only read may not."""
        return False

    def latched(self) -> Samples:
        """Return the sample that the device has latched."""
        return self.rig.sample

    def show(self, sample: Samples) -> None:
        """Put a sample into the registers."""
        raise NotImplementedError

    def show_records(self, address: int, count: int) -> None:
        """Put requested records of earlier samples into the registers; a device may have none."""

    def _put(self, block: Block, values: dict[str, float]) -> None:
        start = block.address - self.first
        self.registers[start : start + block.count] = block.encode(values)


class Drive(Device):
    """A drive: follows its set-point while it is enabled."""

    def __init__(
        self, rig: "VirtualRig", settings: DriveSettings, registers: DriveMap, servo: Servo
    ) -> None:
        self.read = Block(registers_of(registers.read))
        self.write = Block(registers_of(registers.write))
        self.ring = Ring(registers.ring) if registers.ring else None
        super().__init__(rig, settings.unit, registers.identity, (self.read, self.write))
        self.joint = JOINTS.index(settings.joint)
        self.torque_per_ampere = settings.torque_per_ampere
        self.servo = servo
        self._beat: float | None = None
        self.clock: OwnClock | None = None
        self.sample: Samples | None = None
        """Latest sample by its own clock."""

    def spans(self) -> tuple[range, ...]:
        """Return the addresses of its registers and of its ring."""
        return super().spans() + (self.ring.spans if self.ring else ())

    def takes(self, address: int, count: int) -> bool:
        """Return whether registers may be written; those that are only read may not."""
        return (
            self.write.address <= address
            and address + count <= self.write.address + self.write.count
        )

    def receive(self) -> None:
        """Pass a set-point and control word that were written since the last call to the servo."""
        if not self.written:
            return
        self.written = False
        start = self.write.address - self.first
        values = self.write.decode(self.registers[start : start + self.write.count])
        # With a heartbeat register, only a new count proves that the host is alive.
        beat, self._beat = self._beat, values.get("heartbeat")
        if beat is None or beat != self._beat:
            self.servo.receive(values["reference"], int(values["control"]))

    def record(self, samples: Samples) -> None:
        """Add the plant's newest samples."""
        if self.clock:
            samples = self.clock.sampled(samples)
            if len(samples.sequence):
                self.sample = one(samples, -1)
        if self.ring:
            for k, sequence in enumerate(samples.sequence.tolist()):
                self.ring.append(sequence, self._values(one(samples, k)))

    def latched(self) -> Samples:
        """Return the sample that the device has latched."""
        return self.sample or self.rig.sample

    def show(self, sample: Samples) -> None:
        """Put a sample into the registers."""
        self.receive()
        self._put(self.read, self._values(sample))

    def show_records(self, address: int, count: int) -> None:
        """Put the requested records of the ring into the registers."""
        if self.ring:
            self.ring.show(self.registers, self.first, address, count)

    def queue(self, address: int) -> list[int] | None:
        """Remove and return the oldest records of the queue at an address; None for no queue."""
        if self.ring is None or self.ring.fifo != address:
            return None
        self.rig.catch_up()
        return self.ring.take()

    def _values(self, sample: Samples) -> dict[str, float]:
        """Return the values of a sample's registers by quantity, SI units."""
        j = self.joint
        return {
            "sequence": sample.sequence[0] % (self.read.span("sequence") or 2**63),
            "time": sample.time[0] % (self.read.span("time") or np.inf),
            "angle": sample.angle[0, j],
            "velocity": sample.velocity[0, j],
            "current": sample.torque[0, j] / self.torque_per_ampere,
            "temperature": sample.temperature[0, j],
            # The present state, so that a control word shows at once, not at the next sample.
            "status": float(self.servo.status),
            "reference": sample.reference[0, j],
        }


class Sensor(Device):
    """A 3-axis force sensor in a cuff."""

    def __init__(self, rig: "VirtualRig", settings: SensorSettings, registers: SensorMap) -> None:
        self.read = Block(registers_of(registers.read))
        super().__init__(rig, settings.unit, registers.identity, (self.read,))
        self.cuff = CUFFS.index(settings.cuff)

    def show(self, sample: Samples) -> None:
        """Put a sample into the registers."""
        x, y, z = sample.forces[0, self.cuff]
        sequence = sample.sequence[0] % (self.read.span("sequence") or 2**63)
        self._put(self.read, {"sequence": sequence, "force_x": x, "force_y": y, "force_z": z})


def one(samples: Samples, k: int) -> Samples:
    """Return the k-th sample."""
    places = slice(k, k + 1 or None)
    return Samples(**{name: values[places] for name, values in vars(samples).items()})


class VirtualRig:
    """All devices of a rig and the plant behind them."""

    def __init__(self, rig: RigSettings, plant: Plant, sample_rate_hz: float | None = None) -> None:
        """Begin at rest; set-points come at ``sample_rate_hz``, by default the plant's."""
        self.plant = plant
        self.lockstep = rig.clock == "lockstep"
        cycle_hz = sample_rate_hz or plant.settings.sample_rate_hz
        self.samples_per_cycle = round(plant.sample_rate_hz / cycle_hz)
        self.drives = [
            Drive(self, drive, rig.map.drive[drive.map], self._servo(rig, drive, rest))
            for drive, rest in zip(rig.drive, plant.reference, strict=True)
        ]
        self.sensors = [Sensor(self, sensor, rig.map.sensor[sensor.map]) for sensor in rig.sensor]
        self._keep_own_time(cycle_hz * rig.samples_per_cycle(cycle_hz))
        self._advance(plant.reference)
        self._began = asyncio.get_running_loop().time()

    def _keep_own_time(self, rate_hz: float) -> None:
        """Give the drives clocks of their own, where the settings have errors of clocks."""
        settings = self.plant.settings
        if any((*settings.clock_ppm, *settings.clock_offset_s)):
            for drive, ppm, offset in zip(
                self.drives, settings.clock_ppm, settings.clock_offset_s, strict=True
            ):
                drive.clock = OwnClock(ppm, offset, rate_hz, self.plant.sample_rate_hz)

    def exchanged(self, drive: Device) -> None:
        """Note an exchange with a drive; after the last one's reply the plant goes on."""
        self._waiting.discard(drive)
        if self.lockstep and not self._waiting:
            asyncio.get_running_loop().call_soon(self.catch_up)

    def catch_up(self) -> None:
        """Advance the plant to the sample that is due."""
        if self.lockstep:
            if not self._waiting:
                self._advance(self.sample.angle[0], self.samples_per_cycle)
            return
        elapsed = asyncio.get_running_loop().time() - self._began
        due = int(elapsed * self.plant.sample_rate_hz) - int(self.sample.sequence[0])
        if due > 0:
            self._advance(self.sample.angle[0], due)

    async def keep_time(self) -> None:
        """Latch samples by the rig's own clock until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            due = (
                self._began
                + (self.sample.sequence[0] + self.samples_per_cycle) / self.plant.sample_rate_hz
            )
            await asyncio.sleep(max(0.0, due - loop.time()))
            self.catch_up()

    def _servo(self, rig: RigSettings, drive: DriveSettings, rest: float) -> Servo:
        registers, deceleration = rig.map.drive[drive.map], rig.safety.deceleration_rad_s2
        rate, heartbeat_s = self.plant.sample_rate_hz, self.plant.settings.heartbeat_s
        return Servo(
            registers,
            rest,
            drive.angle_rad,
            rate,
            deceleration,
            heartbeat_s,
            self.samples_per_cycle,
        )

    def _advance(self, angle: NDArray, count: int = 1) -> None:
        """Advance by ``count`` samples without new set-points, from measured angles (J,) rad."""
        for drive in self.drives:
            drive.receive()
        set_points = [
            [drive.servo.next(float(angle[drive.joint])) for drive in self.drives]
            for _ in range(count)
        ]
        for enabled, following in groupby(
            set_points, lambda drives: [follows for _, follows in drives]
        ):
            references = np.array([[reference for reference, _ in drives] for drives in following])
            samples = self.plant.run(references, np.array(enabled))
            for drive in self.drives:
                drive.record(samples)
        self.sample = one(samples, -1)
        self._waiting = set(self.drives)


async def serve(
    rig: RigSettings,
    plant: Plant,
    port: int | None,
    announce: Announce,
    until: asyncio.Event,
    bind: str = "127.0.0.1",
    sample_rate_hz: float | None = None,
) -> None:
    """Serve a rig on this computer until an event is set.

    Parameters
    ----------
    rig : RigSettings
    plant : Plant
    port : int or None
        One TCP port for all devices, 0 for a free one per line; None for those of the rig file.
    announce : callable
        Called with the address of each server once it listens, and the name of its line, None for
        devices on no line.
    until : asyncio.Event
    bind : str
        Address on which TCP ports listen.
    sample_rate_hz : float, optional
        Rate of set-points; by default that of the plant's settings.

    Raises
    ------
    SettingsError
        One ``port`` is given for several lines, or for a serial one.
    """
    virtual = VirtualRig(rig, plant, sample_rate_hz)
    on_line: dict[str | int, list[SimDevice]] = defaultdict(list)
    queues: dict[str | int, dict[int, Callable]] = defaultdict(dict)
    for settings, device in zip(
        (*rig.drive, *rig.sensor), (*virtual.drives, *virtual.sensors), strict=True
    ):
        own_port = settings.port if port is None else port
        key = own_port if settings.line is None else settings.line
        on_line[key].append(device.as_served())
        if isinstance(device, Drive):
            queues[key][device.unit] = device.queue
    if port and len(on_line) > 1:
        raise SettingsError(
            f"--port: found {port} for {len(on_line)} lines, expected one line; leave it out for"
            " the places that the rig file names, or give 0 for free ones"
        )
    first_line = rig.line.get(str(next(iter(on_line))))
    if port and isinstance(first_line, RtuLine):
        raise SettingsError(
            f"--port: found {port}, but the rig is on a serial line, {first_line.serial_port};"
            " leave it out, or give 0 for a pseudo-terminal of any name"
        )
    clock = None if virtual.lockstep else asyncio.ensure_future(virtual.keep_time())
    try:
        async with AsyncExitStack() as servers:
            for key, devices in on_line.items():
                name, line = (
                    (key, rig.line[key])
                    if isinstance(key, str)
                    else (None, TcpLine.model_construct(port=key))
                )
                served = listening(_placed(line, bind, port), devices, [fifo_request(queues[key])])
                announce(await servers.enter_async_context(served), name)
            await until.wait()
    finally:
        if clock:
            clock.cancel()


def _placed(line: LineSettings, bind: str, port: int | None) -> LineSettings:
    """Return a line with the address at which it is served."""
    if isinstance(line, RtuLine):
        return line if port is None else line.at("")
    return line.at(f"{bind}:{line.port if port is None else port}")


def serve_file(
    path: Path,
    run: str,
    seed: int,
    port: int | None,
    sample_rate_hz: float | None,
    announce: Announce,
    *,
    until_input_ends: bool,
    bind: str = "127.0.0.1",
) -> None:
    """Serve the rig of a file until a signal comes or, if wanted, standard input is closed.

    The latter ends the rig with the process that started it: the operating system closes the pipe
    even if that process is killed.
    """
    rig = load_rig(path)
    # The first sample compiles the plant, which may take seconds: before a client waits for it.
    build_plant(rig, path, run, seed, sample_rate_hz).run(
        np.zeros((1, len(JOINTS))), np.zeros(len(JOINTS), bool)
    )
    plant = build_plant(rig, path, run, seed, sample_rate_hz)

    async def until_stopped() -> list[int]:
        until = asyncio.Event()
        if until_input_ends:
            loop = asyncio.get_running_loop()

            def wait() -> None:
                sys.stdin.buffer.read()
                loop.call_soon_threadsafe(until.set)

            threading.Thread(target=wait, daemon=True).start()
        with set_on_signals(until) as came:
            await serve(rig, plant, port, announce, until, bind, sample_rate_hz)
        return came

    if rig.clock == "real_time":
        # A garbage collection through all imported modules would cost several samples.
        gc.freeze()
        with suppress(PermissionError, AttributeError):  # Linux grants it to privileged users
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    with asyncio.Runner(loop_factory=exact_event_loop) as runner:
        came = runner.run(until_stopped())
    for number in came:
        # Ctrl-C is the normal end; for other signals the process must end by that signal.
        if number != signal.SIGINT:
            signal.raise_signal(number)
