"""A device that is recorded and checked in simulated time: nothing is waited for, and no computer
is too slow for it."""

import asyncio
import importlib
import itertools
import pkgutil
import time
from contextlib import ExitStack
from types import SimpleNamespace
from unittest.mock import patch

from pymodbus.client.base import ModbusBaseClient

from pipelines import acquisition
from pipelines.acquisition.modbus.device import Device
from pipelines.acquisition.modbus.line import Line
from pipelines.errors import DeviceError
from tests.acquisition.conftest import free_port
from tests.acquisition.simulated import SimulatedTime

ANSWER_S = 0.001


class SimulatedDevice:
    """Counter (100 a second), angle and torque, while it is entered.

    ``answer(n, words)`` gives the words of the n-th answer; ``words`` are the usual ones.
    """

    def __init__(self, answer):
        self.answer, self.port = answer, free_port()
        self.now, self._loop = 1000.0, None
        self._numbers, self._entered = itertools.count(), ExitStack()

    def __enter__(self):
        # Every module of acquisition has the time of the loop that runs.
        watch = SimpleNamespace(
            perf_counter=self._time, monotonic=self._time, time=self._time, gmtime=time.gmtime
        )
        for found in pkgutil.walk_packages(acquisition.__path__, "pipelines.acquisition."):
            module = importlib.import_module(found.name)
            if getattr(module, "time", None) is time:
                self._entered.enter_context(patch.object(module, "time", watch))
        device = self

        async def read(asked, address, count, *, function=3, in_motion=False):
            async def request(device_id):
                await asyncio.sleep(ANSWER_S)
                number = round(100.0 * (device._time() - 1000.0))
                words = device.answer(next(device._numbers), [number, 500, 20])
                if address + count > len(words):
                    raise DeviceError(f"{asked.label}: has no such register")
                return words[address : address + count]

            return await asked.line.ask(asked._unit, 1.0, request)

        async def connect(line):
            pass

        for patched in (
            patch.object(Device, "read", read),
            patch.object(Line, "connect", connect),
            patch.object(ModbusBaseClient, "connected", True),
            patch("pipelines.acquisition.uninterrupted.exact_event_loop", self._new_loop),
            patch("asyncio.run", self._run),
        ):
            self._entered.enter_context(patched)
        return self

    def __exit__(self, *error):
        self._entered.close()

    def _time(self):
        return self.now if self._loop is None else self._loop.time()

    def _new_loop(self):
        self.now, self._loop = self._time(), SimulatedTime()
        self._loop.now = self.now
        return self._loop

    def _run(self, coroutine):
        with asyncio.Runner(loop_factory=self._new_loop) as runner:
            return runner.run(coroutine)
