"""A rig that misbehaves as it is told, in simulated time: what acquisition tells it is kept,
nothing is waited for."""

import asyncio
import heapq
import selectors
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from math import inf, sin
from unittest.mock import patch

from pymodbus.client.base import ModbusBaseClient

from pipelines.acquisition import drive_hold, loop, pacing, progress, stopping
from pipelines.acquisition import exchange as exchanges
from pipelines.acquisition.acquire import record_run
from pipelines.acquisition.loop import Loop
from pipelines.acquisition.machine import drive, drive_protocol, force_sensor, machine
from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.line import Line
from pipelines.acquisition.recording import journal
from pipelines.acquisition.run_outcome import finish_run
from pipelines.acquisition.safety.supervisor import Supervisor
from pipelines.acquisition.states import State
from pipelines.acquisition.uninterrupted import run_to_its_end
from pipelines.errors import DeviceError, Unanswered
from pipelines.modbus.register_block import Block
from pipelines.settings.rig.block import registers_of

RATE = 50.0
LATENCY_S = 0.0003
STEPS = 200_000
"""Turns of the event loop after which a run is taken to hang."""


class SimulatedTime(asyncio.SelectorEventLoop):
    """An event loop whose clock moves only where everything waits."""

    def __init__(self):
        super().__init__(selectors.SelectSelector())
        self.now, self._turns, self.hung = 1000.0, 0, False

    def time(self):
        return self.now

    monotonic = perf_counter = time

    def _run_once(self):
        self._turns += 1
        if self._turns == STEPS:  # once: it is stopped as by any other error
            self.hung = True
            raise AssertionError("the run hangs")
        if not self._ready and self._scheduled:
            while self._scheduled and self._scheduled[0]._cancelled:
                self._timer_cancelled_count -= 1
                heapq.heappop(self._scheduled)._scheduled = False
            if self._scheduled:
                self.now = max(self.now, self._scheduled[0]._when)
        super()._run_once()


@dataclass(frozen=True)
class Event:
    """Something that happens at the n-th request of a run."""

    at: int
    kind: str
    what: object = None


@dataclass(frozen=True)
class Told:
    """A set-point and a control word on their way to a drive."""

    time: float
    joint: int
    reference: float
    control: int
    arrived: bool
    after_idle: bool
    """Whether the drive had said before that it is no longer enabled."""


@dataclass
class Asked:
    """A request whose turn on its line has come, and when it was answered, if it was."""

    label: str
    time: float
    answered: float = inf

    def was_answered_by(self, time):
        return self.answered <= time


@dataclass
class SimulatedDrive:
    """Registers of a drive that follows its set-point at once, and whose control word works by its
    level."""

    joint: int
    settings: object
    map: object
    rig: "SimulatedRig"
    control: int = 0
    angle: float = 0.0
    ahead: int = 0
    frozen_at: int | None = None
    clock_ahead: float = 0.0
    wrong: dict = field(default_factory=dict)
    fault: bool = False
    unpowered: bool = False
    """Whether the emergency stop is pressed."""
    stuck_status: bool = False
    """Whether the status word tells the opposite of what is."""

    latched: int = 0
    seen: float = 0.0
    velocity: float = 0.0
    """Counter, angle and speed of the sample that is latched."""

    def __post_init__(self):
        self.seen = self.told = self.angle
        self.told_at, self.pace = self.rig.count(), 0.0
        self.largest_leap, self.was_enabled, self.said_idle = 0.0, False, False
        self.was_without_torque = False
        self.read, self.write = (
            Block(registers_of(self.map.read)),
            Block(registers_of(self.map.write)),
        )

    @property
    def enabled(self):
        return not (self.fault or self.unpowered) and self.control in (
            self.map.enable,
            self.map.halt,
        )

    def take(self, words):
        told = self.write.decode(words)
        self.go_on()
        was, self.control = self.enabled, int(told["control"])
        samples = max(self.count - self.told_at, 1)
        self.pace = (told["reference"] - self.told) / samples if was and self.enabled else 0.0
        self.told, self.told_at = told["reference"], self.count
        self.was_without_torque |= not self.enabled and self.control != self.map.disable
        if self.enabled:
            self.largest_leap = max(self.largest_leap, abs(self.told - self.angle))
            self.angle = self.told

    def go_on(self):
        """Be where the drive is by now that goes on at its set-points' pace for some samples while
        none comes."""
        if self.rig.goes_on and self.enabled:
            self.angle = self.told + self.pace * min(max(self.count - self.told_at - 1, 0), 5)

    @property
    def says_enabled(self):
        return self.enabled != self.stuck_status

    @property
    def count(self):
        return self.rig.count() if self.frozen_at is None else self.frozen_at

    def latch(self):
        """Take a sample, where a new one is due."""
        self.go_on()
        if self.count != self.latched:
            self.velocity = (self.angle - self.seen) * RATE / (self.count - self.latched)
            self.latched, self.seen = self.count, self.angle

    def say(self):
        """Be heard to tell the status word."""
        self.said_idle |= self.was_enabled and not self.says_enabled
        self.was_enabled |= self.says_enabled

    def words(self):
        values = {
            "sequence": max(self.count + self.ahead, 0),
            "time": max(self.count / RATE + self.clock_ahead, 0.0),
            "angle": self.seen,
            "velocity": self.velocity,
            "current": 0.1 * sin(self.count),
            "temperature": 20.0,
            "reference": self.angle,
            "status": self.says_enabled | 8 * self.fault,
        }
        return self.read.encode(values | self.wrong)


class SimulatedRig:
    """Drives and sensors behind every line that acquisition opens."""

    def __init__(self, rig, events, clock, stopped_by, rest, goes_on):
        self.rig, self.clock, self.stopped_by, self.goes_on = rig, clock, stopped_by, goes_on
        self.requests, self.samples, self.began = 0, 0, clock.now
        self.events = sorted(events, key=lambda event: event.at)
        self.drives = [
            SimulatedDrive(j, d, rig.map.drive[d.map], self, angle=rest[j])
            for j, d in enumerate(rig.drive)
        ]
        self.sensor_block = Block(registers_of(rig.map.sensor["force"].read))
        self.force = 0.0
        self.exchanged, self.dead = set(), {}
        self.told: list[Told] = []
        self.asked: list[Asked] = []
        self.raised: list[tuple[float, BaseException]] = []
        self.failed_to_disable = [0, 0]

    def count(self):
        if self.rig.clock == "lockstep":
            return 100 + self.samples
        return 100 + int((self.clock.now - self.began) * RATE)

    def of(self, label):
        return next((d for d in self.drives if d.settings.joint in label), None)

    def happen(self):
        """Let the events of this request happen; return one that befalls the request itself."""
        self.requests += 1
        befalls = None
        while self.events and self.events[0].at <= self.requests:
            event = self.events.pop(0)
            if event.kind in ("raise", "late", "lost", "no answer", "dead", "broken"):
                befalls = event
            else:
                self._do(event)
        return befalls

    def _do(self, event):
        drive = self.drives[self.requests % 2]
        match event.kind:
            case "signal":
                self.stopped_by.append("SIGTERM")
            case "cancel":
                for task in asyncio.all_tasks():
                    task.cancel()
                self.raised.append((self.clock.now, asyncio.CancelledError()))
            case "interrupt":
                asyncio.get_running_loop().call_soon(self._interrupt)
            case "counter":
                drive.ahead += event.what
            case "freeze":
                drive.frozen_at = self.count()
            case "clock":
                drive.clock_ahead += event.what
            case "reading":
                drive.wrong = dict([event.what])
            case "fault":
                drive.fault = True
            case "power":
                drive.unpowered = not drive.unpowered
            case "status":
                drive.stuck_status = True
            case "force":
                self.force = event.what
            case _:
                raise AssertionError(event.kind)

    def _interrupt(self):
        """Raise what no coroutine sees: it ends the event loop."""
        self.raised.append((self.clock.now, KeyboardInterrupt()))
        raise self.raised[-1][1]

    async def answer(self, device, write, read, within_s):
        """Serve a request, or let what is due befall it; note how it went."""
        asked = Asked(device.label, self.clock.now)
        self.asked.append(asked)
        words = await self._serve(device, write, read, within_s)
        asked.answered = self.clock.now
        return words

    async def _serve(self, device, write, read, within_s):
        event = self.happen()
        drive = self.of(device.label)
        if event and event.kind in ("dead", "broken"):
            self.dead[device.label] = [event.kind] * event.what
        kind = event.kind if event else ""
        if self.dead.get(device.label):
            kind = self.dead[device.label].pop()
        arrived = kind in ("", "late", "no answer")
        if write is not None and drive:
            block, words = write
            told = block.decode(words)
            self.told.append(
                Told(
                    self.clock.now,
                    drive.joint,
                    told["reference"],
                    int(told["control"]),
                    arrived,
                    drive.said_idle,
                )
            )
            if told["control"] == drive.map.disable and kind:
                self.failed_to_disable[drive.joint] += 1
        if kind == "raise":
            error = event.what()
            if isinstance(error, DeviceError):  # a device's own name it
                error = DeviceError(f"{device.label}: {error}")
            self.raised.append((self.clock.now, error))
            raise error
        await asyncio.sleep(event.what if kind == "late" else LATENCY_S)
        if write is not None and drive and arrived:
            drive.take(words)
        if kind in ("lost", "no answer", "dead"):
            await asyncio.sleep(within_s)
            raise Unanswered(f"{device.label}: did not answer")
        if kind == "broken":
            self.raised.append((self.clock.now, DeviceError("broken")))
            raise DeviceError(f"{device.label}: the connection is broken")
        return self._read(drive, write, read)

    def _read(self, drive, write, read):
        if read is None:
            return []
        address, count = read
        if drive is None:
            values = {
                "sequence": self.count(),
                "force_x": self.force,
                "force_y": sin(self.count()),
                "force_z": 0.0,
            }
            return self.sensor_block.encode(values)
        if address == drive.write.address:
            return drive.write.encode(
                {"reference": drive.told, "control": drive.control, "heartbeat": 0}
            )
        if count == drive.read.count:
            drive.latch()
        if address <= drive.map.read.status.address < address + count:
            drive.say()
        block = drive.words()
        start = address - drive.read.address
        if write is not None and self.rig.clock == "lockstep":
            self.exchanged.add(drive.joint)
            if len(self.exchanged) == len(self.drives):
                self.samples, self.exchanged = self.samples + 1, set()
        return block[start : start + count]


@dataclass
class Run:
    """What a simulated run came to."""

    rig: SimulatedRig
    supervisor: Supervisor
    result: object
    """Outcome, or what was raised."""
    aborted_at: float | None
    first_reason: str | None
    states: list
    followed_since: float = inf
    """When the plan was begun to be followed."""


def simulate(rig, settings, trajectory, path, events, rest, *, plan=None, own=None, goes_on=False):
    """Record one run on a simulated rig, whose drives hold while they are told nothing, or go on
    for a while.

    Parameters
    ----------
    events : list of Event
    rest : (hip, knee)
        Where the leg stands, rad.
    plan : callable, optional
        Makes another plan of the one that was made.
    own : (place, n, error), optional
        An error of exoid's own: ``report``, ``journal`` or ``keep`` raises it at its n-th call.
    """
    time = SimulatedTime()
    stopped_by = []
    simulated = SimulatedRig(rig, events, time, stopped_by, rest, goes_on)
    sensors = rig.sensor if settings.run == "with_human" else ()
    supervisor = Supervisor(rig, RATE, sensors)
    run = Run(simulated, supervisor, None, None, None, [supervisor.state])
    metadata = {"run": settings.run, "purpose": "train", "sample_rate_hz": RATE}
    metadata |= {"config": {"run": {"duration_s": settings.duration_s}}}
    with _patched(simulated, time, run, plan, own) as report:
        try:
            run_to_its_end(
                record_run(
                    supervisor,
                    settings,
                    trajectory,
                    path.with_suffix(".journal"),
                    metadata,
                    report,
                    stopped_by,
                    False,
                    lambda: None,
                ),
                supervisor.abort,
            )
            run.result = finish_run(path, path.with_suffix(".journal"), supervisor)
        except BaseException as error:
            run.result = error
    assert not time.hung, "the run hangs"
    return run


@contextmanager
def _patched(simulated, time, run, plan, own):
    place, fails_at, error = own or (None, 0, None)
    calls = 0

    def fail():
        nonlocal calls
        calls += 1
        if calls == fails_at:
            raised = error()
            simulated.raised.append((time.now, raised))
            raise raised

    def report(progress):
        if place == "report":
            fail()

    async def connect(line):
        pass

    async def check_identity(device, identity, function):
        pass

    async def keeps_any_rate(machine, cycle_hz):
        """Events come by the number of requests, and are to befall the run itself."""

    async def ask(device, write, read, within_s):
        async def request(device_id):
            return await simulated.answer(device, write, read, within_s)

        return await device.line.ask(device._unit, within_s, request)

    safety = simulated.rig.safety

    async def read(device, address, count, *, function=3, in_motion=False):
        return await ask(
            device,
            None,
            (address, count),
            safety.longest_reply_s if in_motion else safety.connect_s,
        )

    async def write(device, block, words, *, function=16, in_motion=False):
        await ask(
            device, (block, words), None, safety.longest_reply_s if in_motion else safety.watchdog_s
        )

    async def exchange(device, block, words, read):
        return await ask(device, (block, words), (read.address, read.count), safety.longest_reply_s)

    abort, go = Supervisor.abort, Supervisor._go

    def watched_abort(supervisor, error):
        abort(supervisor, error)
        if run.aborted_at is None:
            run.aborted_at, run.first_reason = time.now, supervisor.why

    def watched_go(supervisor, state):
        go(supervisor, state)
        run.states.append(state)
        if state is State.RAMP:
            run.followed_since = time.now

    with ExitStack() as stack:
        timed = (
            drive,
            drive_protocol,
            exchanges,
            force_sensor,
            drive_hold,
            loop,
            machine,
            pacing,
            progress,
            stopping,
        )
        for module in timed:
            stack.enter_context(patch.object(module, "time", time))
        stack.enter_context(
            patch("pipelines.acquisition.uninterrupted.exact_event_loop", lambda: time)
        )
        # A line gives everybody their turn; every request then goes to the simulated rig.
        for request in (check_identity, read, write, exchange):
            stack.enter_context(patch.object(Device, request.__name__, request))
        stack.enter_context(patch.object(Line, "connect", connect))
        stack.enter_context(
            patch("pipelines.acquisition.acquire.refuse_unkept_rate", keeps_any_rate)
        )
        stack.enter_context(patch.object(ModbusBaseClient, "connected", True))
        stack.enter_context(patch.object(Supervisor, "abort", watched_abort))
        stack.enter_context(patch.object(Supervisor, "_go", watched_go))
        if plan:
            from pipelines.acquisition import acquire

            made = acquire.make_plan
            stack.enter_context(patch.object(acquire, "make_plan", lambda *a: plan(made(*a))))
        for name, where, attribute in (
            ("journal", journal.Journal, "append"),
            ("keep", Loop, "_keep"),
        ):
            if place == name:
                genuine = getattr(where, attribute)
                stack.enter_context(
                    patch.object(
                        where, attribute, lambda *a, genuine=genuine: (fail(), genuine(*a))[1]
                    )
                )
        yield report
        with suppress(RuntimeError):
            time.close()
