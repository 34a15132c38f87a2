"""A leg on pyModbusTCP: what leg_server.c is on libmodbus, written from the register map alone."""

from __future__ import annotations

import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from pyModbusTCP.constants import (
    EXP_DATA_ADDRESS,
    EXP_GATEWAY_TARGET_DEVICE_FAILED_TO_RESPOND,
    EXP_NONE,
)
from pyModbusTCP.server import DataBank, DataHandler, ModbusServer

DRIVES, SENSORS = (1, 2), (11, 12, 13, 14)
READ, WRITE, REGISTERS = 100, 200, 203
ENABLE, READ_WRITE = 0x000F, 23


class Leg(DataHandler):
    """In lockstep: a sample lasts until both drives have been exchanged. The joints are where their
    set-points are."""

    def __init__(self) -> None:
        super().__init__(DataBank(virtual_mode=True))
        self.lock = threading.Lock()  # pyModbusTCP serves every connection in a thread
        self.words = {unit: [0] * REGISTERS for unit in DRIVES + SENSORS}
        for unit, words in self.words.items():
            words[:2] = [0x4558 if unit in DRIVES else 0x4653, 2]
        self.angle = self.last_angle = (0, 0)
        self.sample, self.clock_us = 2**32 - 350, 2**32 - 1_000_000  # both turn over within a run
        self.exchanged: set[int] = set()

    def read_h_regs(self, address, count, srv_info):
        unit, function = srv_info.recv_frame.mbap.unit_id, srv_info.recv_frame.pdu.func_code
        with self.lock:
            if refusal := self._refuses(unit, address, count):
                return refusal
            self._latch()
            self._show(unit)
            if function == READ_WRITE:
                self.exchanged.add(unit)
            return self.Return(EXP_NONE, self.words[unit][address : address + count])

    def write_h_regs(self, address, words_l, srv_info):
        unit = srv_info.recv_frame.mbap.unit_id
        with self.lock:
            if refusal := self._refuses(unit, address, len(words_l)):
                return refusal
            self._latch()  # until now the old set-point held
            self.words[unit][address : address + len(words_l)] = words_l
            return self.Return(EXP_NONE)

    def _refuses(self, unit, address, count):
        if unit not in self.words:
            return self.Return(EXP_GATEWAY_TARGET_DEVICE_FAILED_TO_RESPOND)
        return self.Return(EXP_DATA_ADDRESS) if address + count > REGISTERS else None

    def _latch(self) -> None:
        if self.exchanged != set(DRIVES):
            return
        self.exchanged.clear()
        self.sample, self.clock_us = (self.sample + 1) % 2**32, (self.clock_us + 5000) % 2**32
        self.last_angle = self.angle
        self.angle = tuple(map(self._followed, DRIVES, self.angle))

    def _followed(self, unit: int, angle: int) -> int:
        high, low, control = self.words[unit][WRITE : WRITE + 3]
        return (
            struct.unpack(">i", struct.pack(">HH", high, low))[0]
            if control & ENABLE == ENABLE
            else angle
        )

    def _show(self, unit: int) -> None:
        if unit in DRIVES:
            j = DRIVES.index(unit)
            angle, control = self.angle[j], self.words[unit][WRITE + 2]
            values = (
                self.sample,
                self.clock_us,
                angle,
                (angle - self.last_angle[j]) * 20,
                int(angle / 50) + 1000,
                angle,
                # Halted, a drive is enabled still.
                250 + self.sample % 10,
                control & ENABLE == ENABLE,
            )
            raw = struct.pack(">IIiiiihH", *values)
        else:
            raw = struct.pack(">Ifff", self.sample, unit, self.angle[0] * 1e-5, self.sample % 100)
        words = struct.unpack(f">{len(raw) // 2}H", raw)
        self.words[unit][READ : READ + len(words)] = words


@contextmanager
def serving_on_pymodbustcp() -> Iterator[int]:
    """Serve a leg; yields its port."""
    server = ModbusServer("127.0.0.1", 0, no_block=True, data_hdl=Leg())
    server.start()
    try:
        yield server._service.server_address[1]
    finally:
        server.stop()
