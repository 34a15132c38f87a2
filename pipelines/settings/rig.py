"""A rig file: the devices of a rig, how to read and drive them, what they must never do.

A virtual rig has a ``[plant]`` too, the machine behind its registers. No stage but the rig itself
reads that.
"""

from collections import Counter
from math import inf
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic.main import IncEx

from pipelines.errors import SettingsError
from pipelines.settings.base import Settings, load_toml
from pipelines.settings.bounds import MOST_GRAVITY_M_S2, MOST_LENGTH_M, refuse_absurd
from pipelines.settings.line import LineSettings, TcpLine
from pipelines.settings.plant import PlantSettings

RegisterType = Literal[
    "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"
]
REGISTERS = {
    "int16": 1,
    "uint16": 1,
    "int32": 2,
    "uint32": 2,
    "int64": 4,
    "uint64": 4,
    "float32": 2,
    "float64": 4,
}
"""Registers of 16 bits that a value takes."""

UNITS = {
    "1": 1.0,
    "rad": 1.0,
    "mrad": 1e-3,
    "deg": 0.017453292519943295,
    "rad/s": 1.0,
    "deg/s": 0.017453292519943295,
    "rpm": 0.10471975511965977,
    "A": 1.0,
    "mA": 1e-3,
    "N": 1.0,
    "kN": 1e3,
    "°C": 1.0,
    "s": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
}
"""SI value of one of each unit that a register can hold."""

Unit = Literal[
    "1", "rad", "mrad", "deg", "rad/s", "deg/s", "rpm", "A", "mA", "N", "kN", "°C", "s", "ms", "us"
]

DIMENSION = {
    "sequence": ("1",),
    "status": ("1",),
    "control": ("1",),
    "heartbeat": ("1",),
    "time": ("s", "ms", "us"),
    "angle": ("rad", "mrad", "deg"),
    "reference": ("rad", "mrad", "deg"),
    "velocity": ("rad/s", "deg/s", "rpm"),
    "current": ("A", "mA"),
    "temperature": ("°C",),
    "force_x": ("N", "kN"),
    "force_y": ("N", "kN"),
    "force_z": ("N", "kN"),
}
"""Units in which each quantity can be had."""

MOST_REGISTERS = {"read": 125, "write": 121, "record": 125}
"""What one exchange carries."""

LONGEST_RAMP_S = 60.0
"""Longest way from rest into a motion, s."""

MOST_EVERY = 1000
"""Cycles from one reading of a sensor to the next: at 1000 cycles a second as long as the longest
watchdog waits."""

MOST_QUEUED = 31
"""Registers that one FC24 answer carries."""


class Register(Settings):
    """Where a value lies and what its bits mean: value = raw x scale + offset, in ``unit``."""

    address: int = Field(
        ge=0, le=65535, description="Address of its first register, counted from 0."
    )
    type: RegisterType = Field(description="How the bits are to be read.")
    word_order: Literal["big", "little"] = Field(
        "big", description="Which half of a long value comes first."
    )
    byte_order: Literal["big", "little"] = Field(
        "big", description="Which half of each register comes first."
    )
    scale: float = Field(1.0, description="Units per count; negative turns the sign.")
    offset: float = Field(0.0, ge=-1e12, le=1e12, description="Value at a raw 0, in the unit.")
    unit: Unit = Field("1", description="Unit of the scaled value.")

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if self.scale == 0.0:
            raise ValueError(
                "scale: found 0, expected units per count; every value would be the offset"
            )
        if self.address + self.registers > 65536:
            raise ValueError(
                f"address: found {self.address}, but a {self.type} there ends beyond address 65535"
            )
        return self

    @property
    def registers(self) -> int:
        """How many registers of 16 bits it takes."""
        return REGISTERS[self.type]

    @property
    def si(self) -> tuple[float, float]:
        """SI units per count, and the SI value at a raw 0."""
        return self.scale * UNITS[self.unit], self.offset * UNITS[self.unit]

    @property
    def step(self) -> float:
        """How far the SI values of neighbouring counts are apart; 0 for a float."""
        return 0.0 if self.type.startswith("float") else abs(self.si[0])

    @property
    def counts(self) -> tuple[int, int] | None:
        """The least and the greatest count of an integer; None for a float."""
        if self.type.startswith("float"):
            return None
        bits = 16 * self.registers
        return (
            (0, 2**bits - 1)
            if self.type.startswith("u")
            else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        )

    @property
    def span(self) -> tuple[float, float]:
        """The least and the greatest SI value that it can tell; infinite for a float."""
        if self.counts is None:
            return -inf, inf
        scale, offset = self.si
        low, high = sorted(count * scale + offset for count in self.counts)
        return low, high

    def holds(self, low: float, high: float) -> bool:
        """Tell whether it can hold every SI value from ``low`` to ``high``."""
        scale, offset = self.si
        return self.counts is None or all(
            self.counts[0] <= round((value - offset) / scale) <= self.counts[1]
            for value in (low, high)
        )


class Identity(Settings):
    """A register that tells which device this is, and what it must hold."""

    address: int = Field(ge=0, le=65535, description="Address of the register.")
    value: int = Field(ge=0, le=65535, description="What it holds on the right device.")


class DriveRead(Settings):
    """What a drive tells, all latched at one instant; read in one block."""

    sequence: Register = Field(description="Sample counter.")
    time: Register = Field(description="The device's clock at the sample.")
    angle: Register = Field(description="Joint angle.")
    current: Register = Field(
        description="Motor current, positive where it pushes the angle upward."
    )
    velocity: Register | None = Field(None, description="The drive's own velocity estimate.")
    temperature: Register | None = Field(None, description="Drive or motor temperature.")
    status: Register | None = Field(None, description="Status word.")
    reference: Register | None = Field(
        None, description="Set-point that was in force; else what exoid sent is kept."
    )


class DriveWrite(Settings):
    """What a drive is told, in one block."""

    reference: Register = Field(description="Set-point angle, to be reached within one sample.")
    control: Register = Field(description="Control word.")
    heartbeat: Register | None = Field(
        None, description="Counts up with every write: the host lives."
    )


class RingRecord(Settings):
    """One record of a ring; addresses count from the record's own beginning."""

    sequence: Register = Field(description="Sample counter, which counts as read.sequence does.")
    time: Register = Field(description="The device's clock at the sample.")
    angle: Register = Field(description="Joint angle.")
    current: Register = Field(
        description="Motor current, positive where it pushes the angle upward."
    )
    velocity: Register | None = Field(None, description="The drive's own velocity estimate.")
    reference: Register | None = Field(
        None, description="Set-point in force; left out, recordings hold none."
    )


class RingSettings(Settings):
    """A drive's own record of its latest samples: a ring of registers read by FC03, or a queue read
    by FC24."""

    newest: Register | None = Field(
        None, description="Of a ring: sequence number of the newest whole record."
    )
    address: int | None = Field(
        None, ge=0, le=65535, description="Of a ring: where the record with number 0 begins."
    )
    capacity: int | None = Field(
        None, ge=2, description="Of a ring: records in it; record n is the (n mod it)-th."
    )
    fifo: int | None = Field(
        None, ge=0, le=65535, description="Of a queue: the address that FC24 asks for."
    )
    words: int = Field(
        ge=1,
        le=MOST_REGISTERS["read"],
        description="Registers of 16 bits from one record to the next.",
    )
    record: RingRecord = Field(description="What a record holds.")

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        _refuse_bad_block(self.record, "record")
        found = {
            name for name in ("newest", "address", "capacity") if getattr(self, name) is not None
        }
        if (self.fifo is None) != (len(found) == 3) or (self.fifo is not None and found):
            found |= set() if self.fifo is None else {"fifo"}
            raise ValueError(
                f"ring: found {', '.join(sorted(found)) or 'neither'}, expected newest, address and"
                " capacity (a ring that FC03 reads), or fifo (a queue that FC24 reads)"
            )
        length = max(r.address + r.registers for r in registers_of(self.record).values())
        if length > self.words:
            raise ValueError(
                f"words: found {self.words}, but the record's registers take {length}; correct one"
            )
        if self.fifo is not None and self.words > MOST_QUEUED:
            raise ValueError(
                f"words: found {self.words}, expected at most {MOST_QUEUED}, what an FC24 answer"
                " carries"
            )
        if self.newest is not None:
            _refuse_what_does_not_count(self.newest, "newest")
            self._refuse_bad_ring(self.newest)
        return self

    @property
    def records_per_read(self) -> int:
        """How many records one read brings at most."""
        return (MOST_REGISTERS["read"] if self.fifo is None else MOST_QUEUED) // self.words

    def _refuse_bad_ring(self, newest: Register) -> None:
        assert self.address is not None and self.capacity is not None  # a ring has all three
        end = self.address + self.capacity * self.words
        if end > 65536:
            raise ValueError(
                f"capacity: found {self.capacity}, but such a ring ends beyond address 65535;"
                " lower it"
            )
        if self.address <= newest.address < end:
            raise ValueError(
                f"newest: register {newest.address} is part of the ring itself; correct one address"
            )
        for name, register in (("newest", newest), ("record.sequence", self.record.sequence)):
            span = 2 ** (16 * register.registers)
            # Else records would change places when the counter begins anew.
            if not register.type.startswith("u") or span % self.capacity:
                raise ValueError(
                    f"{name}.type: found {register.type} with a capacity of {self.capacity},"
                    " expected an unsigned counter whose range is a multiple of the capacity (any"
                    " power of 2)"
                )


class SensorRead(Settings):
    """What a 3-axis force sensor tells; read in one block. Axes are those of the segment, see
    docs/contracts.md."""

    sequence: Register = Field(description="Sample counter.")
    force_x: Register = Field(description="Force along the segment (distal).")
    force_y: Register = Field(description="Force forward.")
    force_z: Register = Field(description="Lateral force.")


class DriveMap(Settings):
    """Register map of a make of drives."""

    identity: tuple[Identity, ...] = Field(
        (), description="What tells the right device from a wrong one."
    )
    read: DriveRead = Field(description="Block that is read.")
    write: DriveWrite = Field(description="Block that is written as a whole, without gaps.")
    own_scale: bool = Field(
        False,
        description=(
            "Set-points mean the same place as angles though their type, order, scale or offset is"
            " another; else that is taken for a slip, and refused."
        ),
    )
    enable: int = Field(1, description="Control word that makes the drive follow its set-point.")
    disable: int = Field(0, description="Control word that takes the torque away.")
    halt: int | None = Field(
        None, description="Control word that holds the leg where a stop has led it; else enable."
    )
    fault_reset: int | None = Field(
        None, description="Control word that clears a fault, for --reset-faults."
    )
    fault_mask: int = Field(
        0, ge=0, description="Bits of the status word that mean a fault; 0 for none."
    )
    faults: dict[Annotated[int, Field(ge=0, lt=64)], str] = Field(
        default_factory=dict,
        description="What a fault bit means, by its number; bit 0 is the lowest.",
    )
    enabled_mask: int = Field(
        0, ge=0, description="Bits of the status word that tell whether it is enabled; 0: none."
    )
    enabled_value: int = Field(0, ge=0, description="What these bits are while it is enabled.")
    ring: RingSettings | None = Field(
        None, description="The drive's own record of its latest samples, if it has one."
    )

    @model_validator(mode="after")
    def _blocks_are_possible(self) -> Self:
        _refuse_bad_block(self.read, "read")
        _refuse_bad_block(self.write, "write")
        _refuse_gap(self.write, "write")
        for name in ("fault_mask", "enabled_mask"):
            if getattr(self, name) and self.read.status is None:
                raise ValueError(
                    f"{name}: needs a status register; add read.status or leave the mask out"
                )
        for bit in self.faults:
            if not self.fault_mask >> bit & 1:
                raise ValueError(
                    f"faults: bit {bit} is not one of fault_mask 0x{self.fault_mask:04X}; add"
                    f" 0x{1 << bit:04X} to the mask, or leave the name out"
                )
        if self.enabled_value & ~self.enabled_mask:
            raise ValueError(
                f"enabled_value: found 0x{self.enabled_value:04X}, expected bits of enabled_mask "
                f"0x{self.enabled_mask:04X} only; correct one of them"
            )
        self._refuse_bits_that_tell_nothing()
        counters = (
            {"newest": self.ring.newest, "record.sequence": self.ring.record.sequence}
            if self.ring
            else {}
        )
        for name, counter in counters.items():
            if counter and counter.type != self.read.sequence.type:
                raise ValueError(
                    f"ring.{name}.type: found {counter.type}, expected {self.read.sequence.type} as"
                    " in read.sequence: it is the same counter"
                )
        return self

    def _refuse_bits_that_tell_nothing(self) -> None:
        """Refuse bits by which an enabled drive is not told from a disabled one, or from one with a
        fault."""
        if self.enabled_mask and "enabled_value" not in self.model_fields_set:
            raise ValueError(
                f"enabled_value: missing beside enabled_mask 0x{self.enabled_mask:04X}, expected"
                " what these bits are while the drive is enabled, see its manual; give it"
            )
        if both := self.enabled_value & self.fault_mask:
            raise ValueError(
                f"fault_mask: found 0x{self.fault_mask:04X}, of which 0x{both:04X} is in"
                f" enabled_value 0x{self.enabled_value:04X} too, expected other bits: an enabled"
                " drive has no fault; correct one of them"
            )
        if self.enabled_mask and not self.enabled_mask & ~self.fault_mask:
            raise ValueError(
                f"enabled_mask: found 0x{self.enabled_mask:04X}, all of it in fault_mask"
                f" 0x{self.fault_mask:04X}, expected a bit that tells an enabled drive from a"
                " disabled one; correct one of them"
            )

    @model_validator(mode="after")
    def _control_words_differ(self) -> Self:
        words = {name: getattr(self, name) for name in ("enable", "disable", "halt", "fault_reset")}
        for word, times in Counter(word for word in words.values() if word is not None).items():
            if times > 1:
                same = " and ".join(name for name, value in words.items() if value == word)
                raise ValueError(
                    f"{same}: both are 0x{word:04X}, expected different control words; correct one"
                )
        return self

    @model_validator(mode="after")
    def _words_and_masks_fit_their_registers(self) -> Self:
        words = {name: getattr(self, name) for name in ("enable", "disable", "halt", "fault_reset")}
        masks = {name: getattr(self, name) for name in ("fault_mask", "enabled_mask")}
        for name, register, told in (
            ("write.control", self.write.control, words),
            ("read.status", self.read.status, masks),
        ):
            if register is None:
                continue
            if not register.type.startswith("u") or (register.scale, register.offset) != (1.0, 0.0):
                raise ValueError(
                    f"{name}: found {register.type} with scale {register.scale:g} and offset"
                    f" {register.offset:g}, expected uint16, uint32 or uint64 as it is: its bits"
                    " have meanings of their own; correct it"
                )
            for key, value in told.items():
                if value is not None and not register.holds(value, value):
                    raise ValueError(
                        f"{key}: found 0x{value:X}, but {name} is a {register.type}; correct one of"
                        " them"
                    )
        return self

    def told_faults(self, status: int) -> str:
        """Return the fault bits of a status word, and their names as far as they have any; nothing
        without a fault."""
        found = status & self.fault_mask
        names = [
            self.faults.get(bit, f"bit {bit}")
            for bit in range(found.bit_length())
            if found >> bit & 1
        ]
        if not found:
            return ""
        return f"0x{found:04X}" + (f": {', '.join(names)}" if self.faults else "")


class SensorMap(Settings):
    """Register map of a make of force sensors."""

    identity: tuple[Identity, ...] = Field(
        (), description="What tells the right device from a wrong one."
    )
    read: SensorRead = Field(description="Block that is read.")

    @model_validator(mode="after")
    def _block_is_possible(self) -> Self:
        _refuse_bad_block(self.read, "read")
        return self


def registers_of(block: Settings) -> dict[str, Register]:
    """Return a block's registers by quantity, those that are not there left out."""
    return {name: register for name, register in block if register is not None}


def _refuse_bad_block(block: Settings, name: str) -> None:
    registers = registers_of(block)
    for quantity, register in registers.items():
        if register.unit not in DIMENSION[quantity]:
            allowed = " or ".join(DIMENSION[quantity])
            raise ValueError(
                f"{name}.{quantity}.unit: found {register.unit!r}, expected {allowed}; correct the"
                " unit"
            )
    for quantity in ("sequence", "heartbeat"):
        if quantity in registers:
            _refuse_what_does_not_count(registers[quantity], f"{name}.{quantity}")
    if "time" in registers and registers["time"].scale < 0.0:
        raise ValueError(
            f"{name}.time.scale: found {registers['time'].scale:g}, expected a clock that goes"
            " forward; turn its sign"
        )
    taken: dict[int, str] = {}
    for quantity, register in registers.items():
        for address in range(register.address, register.address + register.registers):
            if address in taken:
                raise ValueError(
                    f"{name}.{quantity}: register {address} is part of {taken[address]} too;"
                    " correct one address"
                )
            taken[address] = quantity
    length = max(taken) - min(taken) + 1
    if length > MOST_REGISTERS[name]:
        raise ValueError(
            f"{name}: spans {length} registers ({min(taken)} to {max(taken)}), expected at most "
            f"{MOST_REGISTERS[name]}, which is what one Modbus exchange carries"
        )


def _refuse_what_does_not_count(register: Register, name: str) -> None:
    """Refuse a counter whose raw value is not the count: where it begins anew would be anybody's
    guess."""
    if not register.type.startswith("u") or (register.scale, register.offset) != (1.0, 0.0):
        raise ValueError(
            f"{name}: found {register.type} with scale {register.scale:g} and offset"
            f" {register.offset:g}, expected uint16, uint32 or uint64 as it is: it is a count;"
            " correct it"
        )


def _refuse_gap(block: Settings, name: str) -> None:
    """Refuse a block with registers that nobody named: writing it would put something into them."""
    named = {
        a for r in registers_of(block).values() for a in range(r.address, r.address + r.registers)
    }
    if nameless := sorted(set(range(min(named), max(named))) - named):
        raise ValueError(
            f"{name}: names nothing at register {nameless[0]} between {min(named)} and"
            f" {max(named)}, expected a block without gaps, which is written as a whole; map the"
            " drive's registers side by side"
        )


TIGHTER = "with somebody in the machine a limit may only be tighter"


def _refuse_looser(settings: "DriveSettings | SafetySettings", *names: str) -> None:
    """Refuse limits of runs with_human above those of the others."""
    for name in names:
        found, allowed = getattr(settings.with_human, name), getattr(settings, name)
        if found is not None and found > allowed:
            raise ValueError(
                f"with_human.{name}: found {found:g}, expected at most {name} ({allowed:g});"
                f" {TIGHTER}"
            )


class DeviceSettings(Settings):
    """Where a device is found."""

    line: str | None = Field(
        None, description="The line it is on, a table below [line]; else one of its own by TCP."
    )
    host: str = Field(
        "127.0.0.1", description="Name or address; an embedded rig is always on this machine."
    )
    port: int = Field(
        502, ge=1, le=65535, description="TCP port; an embedded rig chooses a free one."
    )
    unit: int = Field(1, ge=1, le=247, description="Modbus unit id.")
    map: str = Field(description="Its register map, a table below [map].")

    @model_validator(mode="after")
    def _is_in_one_place(self) -> Self:
        for key in ("host", "port"):
            if self.line is not None and key in self.model_fields_set:
                raise ValueError(
                    f"{key}: found beside line = {self.line!r}, which says where the device is;"
                    " remove one"
                )
        return self


class HumanDriveSettings(Settings):
    """What a joint may do with somebody in the machine; what is left out is as without."""

    angle_rad: tuple[float, float] | None = Field(None, description="Lowest and highest angle.")
    speed_rad_s: float | None = Field(None, gt=0.0, description="Highest speed, either way.")
    torque_nm: float | None = Field(
        None, gt=0.0, description="Highest torque at the joint, either way."
    )


class HumanSafetySettings(Settings):
    """What stops a run with somebody in the machine; what is left out is as without."""

    cuff_force_n: float | None = Field(
        None, gt=0.0, description="Highest force on any axis of any cuff sensor."
    )
    following_error_rad: float | None = Field(
        None, gt=0.0, description="Farthest an angle may be from its set-point."
    )


class DriveSettings(DeviceSettings):
    """A drive, its transmission, and what its joint may do."""

    joint: Literal["hip", "knee"] = Field(description="The joint it moves.")
    torque_constant_nm_a: float = Field(gt=0.0, description="Motor torque per ampere.")
    gear_ratio: float = Field(gt=0.0, description="Motor turns per turn of the joint.")
    angle_rad: tuple[float, float] = Field(description="Lowest and highest angle.")
    speed_rad_s: float = Field(gt=0.0, description="Highest speed, either way.")
    torque_nm: float = Field(gt=0.0, description="Highest torque at the joint, either way.")
    with_human: HumanDriveSettings = Field(
        HumanDriveSettings(), description="Tighter limits of runs with_human."
    )

    @model_validator(mode="after")
    def _low_is_below_high(self) -> Self:
        for low, high in (self.angle_rad, self.with_human.angle_rad or self.angle_rad):
            if low >= high:
                raise ValueError(
                    f"angle_rad: found [{low}, {high}], expected the lowest angle first; swap them"
                )
        return self

    @model_validator(mode="after")
    def _limits_with_human_are_tighter(self) -> Self:
        low, high = self.with_human.angle_rad or self.angle_rad
        if low < self.angle_rad[0] or high > self.angle_rad[1]:
            raise ValueError(
                f"with_human.angle_rad: found [{low:g}, {high:g}], expected within angle_rad"
                f" [{self.angle_rad[0]:g}, {self.angle_rad[1]:g}]; {TIGHTER}"
            )
        _refuse_looser(self, "speed_rad_s", "torque_nm")
        return self

    @property
    def torque_per_ampere(self) -> float:
        """Torque at the joint, N·m/A."""
        return self.torque_constant_nm_a * self.gear_ratio


class SensorSettings(DeviceSettings):
    """A cuff force sensor."""

    cuff: Literal["thigh_front", "thigh_back", "shank_front", "shank_back"] = Field(
        description="Where it sits."
    )
    every: int = Field(
        1,
        ge=1,
        le=MOST_EVERY,
        description=(
            "Cycles from one reading to the next; rows between hold no force. Sensors with the same"
            " number take turns."
        ),
    )


class ControllerSettings(Settings):
    """The loop inside a drive, as far as it is known; it is copied into every recording."""

    type: str = Field("pd", description="Kind of loop.")
    kp_nm_rad: float | None = Field(None, description="Stiffness.")
    kd_nm_s_rad: float | None = Field(None, description="Damping.")
    rate_hz: float | None = Field(None, gt=0.0, description="Rate of the loop.")
    limit_nm: float | None = Field(None, gt=0.0, description="Torque at which it saturates.")


class GeometrySettings(Settings):
    """Lengths of the leg in this rig; what is left out comes from exoid.toml."""

    thigh_length_m: float | None = Field(
        None, gt=0.0, le=MOST_LENGTH_M, description="Hip axis to knee axis."
    )
    gravity_m_s2: float | None = Field(
        None, ge=0.0, le=MOST_GRAVITY_M_S2, description="Acceleration of gravity."
    )
    thigh_cuff_distance_m: float | None = Field(
        None, gt=0.0, le=MOST_LENGTH_M, description="Hip axis to thigh cuff."
    )
    shank_cuff_distance_m: float | None = Field(
        None, gt=0.0, le=MOST_LENGTH_M, description="Knee axis to shank cuff."
    )


class SafetySettings(Settings):
    """What stops a run, and how."""

    angle_margin_rad: float = Field(
        0.02, ge=0.0, description="Set-points keep this far from each angle limit."
    )
    cuff_force_n: float = Field(
        400.0, gt=0.0, description="Highest force on any axis of any cuff sensor."
    )
    following_error_rad: float = Field(
        0.15, gt=0.0, description="Farthest an angle may be from its set-point."
    )
    watchdog_s: float = Field(
        0.1, gt=0.0, description="Longest a cycle or a device's next sample may take."
    )
    reply_s: float | None = Field(
        None,
        gt=0.0,
        description=(
            "Longest wait for one reply in motion, then it is a gap; else 0.3 of watchdog_s."
        ),
    )
    heartbeat_s: float | None = Field(
        None,
        gt=0.0,
        description=(
            "Time-out of the drives' own watchdogs, as it is set in them; else it is not known."
        ),
    )
    connect_s: float = Field(
        5.0, gt=0.0, description="Longest wait, before anything moves, for a line or a reply."
    )
    control_s: float = Field(
        1.0, gt=0.0, description="Longest a drive may take to do what a control word tells it."
    )
    deceleration_rad_s2: float = Field(
        8.0, gt=0.0, le=100.0, description="How a stop slows the set-points down."
    )
    ramp_s: float = Field(
        3.0, gt=0.0, le=LONGEST_RAMP_S, description="Shortest way into the motion, and back."
    )
    settle_s: float = Field(
        1.0, ge=0.0, description="Motion before the recording begins, for transients to fade."
    )
    with_human: HumanSafetySettings = Field(
        HumanSafetySettings(), description="Tighter limits of runs with_human."
    )

    @model_validator(mode="after")
    def _limits_with_human_are_tighter(self) -> Self:
        _refuse_looser(self, "cuff_force_n", "following_error_rad")
        return self

    @model_validator(mode="after")
    def _a_reply_is_awaited_less_long_than_the_watchdog(self) -> Self:
        if self.longest_reply_s >= self.watchdog_s:
            raise ValueError(
                f"reply_s: found {self.reply_s:g}, expected less than watchdog_s"
                f" ({self.watchdog_s:g}), or one lost reply stops the run; leave it out"
            )
        return self

    @property
    def longest_reply_s(self) -> float:
        """Longest wait for one reply while the leg moves, s."""
        # Not a third: three lost replies are borne, and the fourth, not the watchdog, says who is
        # silent.
        return 0.3 * self.watchdog_s if self.reply_s is None else self.reply_s


class Maps(Settings):
    """Register maps by name."""

    drive: dict[str, DriveMap] = Field(description="Maps of drives.")
    sensor: dict[str, SensorMap] = Field(default_factory=dict, description="Maps of force sensors.")


class RigSettings(Settings):
    """Everything exoid knows of a rig."""

    name: Annotated[str, Field(min_length=1)] = Field(description="Name that recordings carry.")
    embedded: bool = Field(
        False, description="Virtual: `exoid acquire` starts it in a process of its own."
    )
    clock: Literal["lockstep", "real_time"] = Field(
        "real_time",
        description="Devices sample on their own clock, or (virtual rigs) once for each exchange.",
    )
    clocks: Literal["common", "own"] = Field(
        "common", description="Drives sample at the same instants, or each by a clock of its own."
    )
    sampling: Literal["cyclic", "recorder"] = Field(
        "cyclic",
        description=(
            "Samples are fetched with each set-point, or drained from the drives' own rings."
        ),
    )
    record_rate_hz: float | None = Field(
        None, gt=0.0, description="Samples a second in the drives' rings."
    )
    drive: tuple[DriveSettings, ...] = Field(min_length=1, description="The drives.")
    sensor: tuple[SensorSettings, ...] = Field(
        (), description="Cuff force sensors, read with a human only."
    )
    line: dict[str, LineSettings] = Field(
        default_factory=dict, description="Lines that devices share, by name."
    )
    map: Maps = Field(description="Register maps.")
    safety: SafetySettings = Field(SafetySettings(), description="What stops a run, and how.")
    geometry: GeometrySettings = Field(GeometrySettings(), description="The leg in this rig.")
    controller: dict[Literal["hip", "knee"], ControllerSettings] = Field(
        default_factory=dict, description="The loops inside the drives."
    )
    plant: PlantSettings | None = Field(None, description="The machine behind a virtual rig.")

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if tuple(drive.joint for drive in self.drive) != ("hip", "knee"):
            found = ", ".join(drive.joint for drive in self.drive)
            raise ValueError(
                f"drive: found {found}, expected one for the hip, then one for the knee"
            )
        for kind in ("drive", "sensor"):
            known = getattr(self.map, kind)
            for i, device in enumerate(getattr(self, kind)):
                if device.map not in known:
                    raise ValueError(
                        f"{kind}[{i}].map: found {device.map!r}, expected a table below"
                        f" [map.{kind}]: {', '.join(known) or 'there is none'}"
                    )
        self._refuse_bad_lines()
        for cuff, times in Counter(sensor.cuff for sensor in self.sensor).items():
            if times > 1:
                raise ValueError(
                    f"sensor: found two sensors at {cuff}, expected one; correct their cuffs"
                )
        if self.plant is None and (self.embedded or self.clock == "lockstep"):
            raise ValueError(
                "plant: missing; a virtual rig (embedded, or in lockstep) needs the machine it"
                " plays"
            )
        self._refuse_impossible_sampling()
        self._refuse_torque_that_is_never_told()
        if self.plant is None:  # nobody is in a virtual one
            refuse_absurd(self)
        self._refuse_margins_that_leave_no_room()
        self._refuse_impossible_set_points()
        self._refuse_limits_that_registers_cannot_tell()
        return self

    def _refuse_margins_that_leave_no_room(self) -> None:
        """Refuse a distance from the limits that no set-point can keep."""
        margin = self.safety.angle_margin_rad
        for drive in self.drive:
            for key, limits in (
                ("angle_rad", drive.angle_rad),
                ("with_human.angle_rad", drive.with_human.angle_rad),
            ):
                if limits and not margin < (limits[1] - limits[0]) / 2.0:
                    raise ValueError(
                        f"safety.angle_margin_rad: found {margin:g}, expected less than"
                        f" {(limits[1] - limits[0]) / 2.0:g}, half of the {drive.joint}'s {key}, or"
                        " no set-point keeps it; lower it"
                    )

    def _refuse_impossible_set_points(self) -> None:
        """Refuse registers that cannot hold every set-point, or so coarsely that rounding leads the
        leg astray."""
        following_rad = (
            self.safety.with_human.following_error_rad or self.safety.following_error_rad
        )
        for drive in self.drive:
            register, (low, high) = self.map.drive[drive.map].write.reference, drive.angle_rad
            if not register.holds(low, high):
                raise ValueError(
                    f"map.drive.{drive.map}.write.reference: cannot hold {low:g} to {high:g} rad,"
                    f" the {drive.joint}'s limits; correct its type or scale"
                )
            low, high = drive.with_human.angle_rad or drive.angle_rad
            coarsest = min(following_rad, high - low) / 4.0
            if register.step > coarsest:
                raise ValueError(
                    f"map.drive.{drive.map}.write.reference: one count is {register.step:.3g} rad,"
                    f" expected at most {coarsest:.3g} rad, a quarter of safety.following_error_rad"
                    f" or of the {drive.joint}'s range; correct its scale"
                )

    def _refuse_torque_that_is_never_told(self) -> None:
        """Refuse limits that a drive never tells more than, since it saturates: they would be
        watched in vain."""
        for drive in self.drive:
            loop = self.controller.get(drive.joint)
            if loop and loop.limit_nm is not None and drive.torque_nm >= loop.limit_nm:
                raise ValueError(
                    f"torque_nm: found {drive.torque_nm:g} of the {drive.joint}, expected less than"
                    f" its controller.limit_nm ({loop.limit_nm:g}), which the drive never goes"
                    " beyond; lower it"
                )

    def _refuse_limits_that_registers_cannot_tell(self) -> None:
        """Refuse registers that end before a limit: it would be watched in vain, and the end taken
        for true."""
        for drive in self.drive:
            use, most = self.map.drive[drive.map], drive.torque_nm / drive.torque_per_ampere
            reach = {
                "angle": drive.angle_rad,
                "velocity": (-drive.speed_rad_s, drive.speed_rad_s),
                "current": (-most, most),
            }
            blocks = {"read": use.read} | ({"ring.record": use.ring.record} if use.ring else {})
            for block, registers in blocks.items():
                for name, limits in reach.items():
                    _refuse_short(
                        f"map.drive.{drive.map}.{block}.{name}",
                        getattr(registers, name),
                        limits,
                        drive.joint,
                    )
        for sensor in self.sensor:
            most = self.safety.cuff_force_n
            for name in ("force_x", "force_y", "force_z"):
                register = getattr(self.map.sensor[sensor.map].read, name)
                _refuse_short(
                    f"map.sensor.{sensor.map}.read.{name}", register, (-most, most), sensor.cuff
                )

    def _refuse_bad_lines(self) -> None:
        devices = (*self.drive, *self.sensor)
        for device in devices:
            if device.line is not None and device.line not in self.line:
                raise ValueError(
                    f"line: found {device.line!r} at unit {device.unit}, expected a table below"
                    f" [line]: {', '.join(self.line) or 'there is none'}"
                )
        for name in self.line:
            if name not in {device.line for device in devices}:
                raise ValueError(
                    f'line.{name}: no device is on it; remove it, or give one line = "{name}"'
                )
        for place, times in Counter(line.place for line in self.line.values()).items():
            if times > 1:
                raise ValueError(
                    f"line: two lines lead to {place}; make them one, with all its devices on it"
                )
        for (place, unit), times in Counter(
            (self.line_of(d).place, d.unit) for d in devices
        ).items():
            if times > 1:
                raise ValueError(f"unit: {place} unit {unit} stands for two devices; correct one")

    def line_of(self, device: DeviceSettings) -> LineSettings:
        """Return the line that a device is on."""
        return (
            TcpLine(host=device.host, port=device.port)
            if device.line is None
            else self.line[device.line]
        )

    def turn_of(self, sensor: SensorSettings) -> int:
        """Return in which of its ``every`` cycles a sensor is read: those that are read equally
        seldom take turns."""
        alike = [other.cuff for other in self.sensor if other.every == sensor.every]
        return alike.index(sensor.cuff) % sensor.every

    def in_force(self, run: str) -> Self:
        """Return the rig with the limits in force in a run (``exo_alone`` or ``with_human``), and
        no others."""
        human = run == "with_human"
        drives = tuple(
            drive.model_copy(
                update={"with_human": HumanDriveSettings()}
                | (drive.with_human.model_dump(exclude_none=True) if human else {})
            )
            for drive in self.drive
        )
        tighter = self.safety.with_human.model_dump(exclude_none=True) if human else {}
        safety = self.safety.model_copy(update={"with_human": HumanSafetySettings()} | tighter)
        return self.model_copy(update={"drive": drives, "safety": safety})

    def label_of(self, device: DriveSettings | SensorSettings) -> str:
        """Return what errors call a device: what it is, and where."""
        name = (
            f"drive {device.joint}"
            if isinstance(device, DriveSettings)
            else f"sensor {device.cuff}"
        )
        return f"{name} ({self.line_of(device).place}, unit {device.unit})"

    def _refuse_impossible_sampling(self) -> None:
        drifts = self.plant is not None and any((*self.plant.clock_ppm, *self.plant.clock_offset_s))
        if self.clock == "lockstep" and (self.clocks == "own" or drifts):
            raise ValueError(
                'clock: found "lockstep", in which no time goes by; clocks of their own need'
                ' "real_time"'
            )
        if self.sampling == "cyclic":
            return
        if self.record_rate_hz is None:
            raise ValueError(
                'record_rate_hz: missing; sampling = "recorder" needs the rate of the drives\''
                " rings"
            )
        for i, drive in enumerate(self.drive):
            if self.map.drive[drive.map].ring is None:
                raise ValueError(
                    f'drive[{i}].map: {drive.map} has no ring, which sampling = "recorder" drains;'
                    f' add [map.drive.{drive.map}.ring], or set sampling = "cyclic"'
                )

    def samples_per_cycle(self, sample_rate_hz: float) -> int:
        """Return how many samples the drives take from one set-point to the next, or raise a
        SettingsError."""
        if self.sampling == "cyclic" or self.record_rate_hz is None:
            return 1
        ratio = self.record_rate_hz / sample_rate_hz
        if ratio < 1.0 or abs(ratio - round(ratio)) > 1e-9:
            raise SettingsError(
                f"record_rate_hz: found {self.record_rate_hz:g} with set-points at"
                f" {sample_rate_hz:g} Hz, expected a whole multiple; change it or"
                " acquire.sample_rate_hz"
            )
        for name, drive in self.map.drive.items():
            if drive.ring and drive.ring.capacity and drive.ring.capacity < 2 * ratio:
                raise SettingsError(
                    f"map.drive.{name}.ring.capacity: found {drive.ring.capacity} with {ratio:.0f}"
                    f" records from one set-point to the next, expected at least {2 * ratio:.0f},"
                    " or they are overwritten before they are read; lower record_rate_hz or raise"
                    " acquire.sample_rate_hz"
                )
        return round(ratio)

    def known_geometry(self) -> dict[str, float]:
        """Return the lengths that are known of this rig's leg; a virtual rig's are its plant's
        unless the file says."""
        plant = (
            {name: getattr(self.plant, name) for name in GeometrySettings.model_fields}
            if self.plant
            else {}
        )
        return plant | self.geometry.model_dump(exclude_none=True)

    def known_controllers(self) -> dict[str, dict]:
        """Return what is known of the drives' loops, by joint; a virtual rig's are its plant's
        unless the file says."""
        plant = self.plant.controllers() if self.plant else {}
        return plant | {
            joint: loop.model_dump(exclude_none=True) for joint, loop in self.controller.items()
        }

    @property
    def known_heartbeat_s(self) -> tuple[str, float | None]:
        """The key that tells how long the drives' own watchdogs wait, and what it tells, s; None
        where nobody does."""
        if self.safety.heartbeat_s is None and self.plant:
            return "plant.heartbeat_s", self.plant.heartbeat_s
        return "safety.heartbeat_s", self.safety.heartbeat_s

    def public(self) -> dict:
        """Return what recordings may tell of the rig: everything but the plant, which later stages
        are to find."""
        files: IncEx = {name: set(line.files) for name, line in self.line.items()}
        return self.model_dump(
            mode="json", exclude={"plant": True, "line": files}, exclude_none=True
        )


def load_rig(path: Path | str) -> RigSettings:
    """Return the rig in a file; what files it names are found from there."""
    rig = load_toml(path, RigSettings)
    lines = {name: line.with_files_in(Path(path).parent) for name, line in rig.line.items()}
    return rig.model_copy(update={"line": lines})


def _refuse_short(
    key: str, register: Register | None, limits: tuple[float, float], whose: str
) -> None:
    """Refuse a register that cannot tell a value beyond both limits, SI."""
    if register is None:
        return
    low, high = register.span
    if not (low < limits[0] and limits[1] < high):
        raise ValueError(
            f"{key}: an {register.type} of this scale tells {low:.4g} to {high:.4g}, expected more"
            f" than {limits[0]:.4g} to {limits[1]:.4g} (SI units), what the limits of {whose} are"
            " there; correct its type or scale, or lower the limits"
        )
