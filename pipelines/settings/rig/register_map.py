"""``[map]`` of a rig file: which registers the drives and force sensors of a make have."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipelines.settings.base import Settings, repeated
from pipelines.settings.rig.block import ReadBlock, check_block, check_counter, registers_of
from pipelines.settings.rig.register import Register
from pipelines.settings.rig.requests import requests_of
from pipelines.settings.rig.ring import RingSettings


class Identity(Settings):
    """A register that identifies a device, and its value there."""

    address: int = Field(ge=0, le=65535, description="Address of the register.")
    value: int = Field(ge=0, le=65535, description="Its value on the right device.")
    function: Literal[3, 4] | None = Field(None, description="3 or 4; else that of read.")


class DriveRead(ReadBlock):
    """Values of a drive, all latched at one instant."""

    sequence: Register = Field(description="Sample counter.")
    time: Register = Field(description="The device's clock at the sample.")
    angle: Register = Field(description="Joint angle.")
    current: Register = Field(description="Motor current, positive if it increases the angle.")
    velocity: Register | None = Field(None, description="The drive's own velocity estimate.")
    temperature: Register | None = Field(None, description="Drive or motor temperature.")
    status: Register | None = Field(None, description="Status word.")
    reference: Register | None = Field(None, description="Set-point in force; else the sent one.")


class DriveWrite(Settings):
    """Values sent to a drive."""

    function: Literal[6, 16, 23] = Field(
        23, description="23 writes and reads in one exchange; 16 and 6 write only."
    )
    reference: Register = Field(description="Set-point angle, to be reached within one sample.")
    control: Register = Field(description="Control word.")
    heartbeat: Register | None = Field(None, description="Counts up with every write.")


class SensorRead(ReadBlock):
    """Values of a 3-axis force sensor; axes as in docs/contracts.md."""

    sequence: Register = Field(description="Sample counter.")
    force_x: Register = Field(description="Force along the segment (distal).")
    force_y: Register = Field(description="Force forward.")
    force_z: Register = Field(description="Lateral force.")


class DriveMap(Settings):
    """Register map of a make of drives."""

    identity: tuple[Identity, ...] = Field((), description="Registers that identify the make.")
    read: DriveRead = Field(description="Block that is read.")
    write: DriveWrite = Field(description="Block that is written.")
    own_scale: bool = Field(
        False, description="Set-points agree with angles though their registers differ."
    )
    enable: int = Field(1, description="Control word that makes the drive follow its set-point.")
    disable: int = Field(0, description="Control word that takes the torque away.")
    halt: int | None = Field(None, description="Control word that holds the leg; else enable.")
    fault_reset: int | None = Field(None, description="Control word that clears a fault.")
    fault_mask: int = Field(0, ge=0, description="Bits of the status that mean a fault.")
    faults: dict[Annotated[int, Field(ge=0, lt=64)], str] = Field(
        default_factory=dict, description="Meaning of each fault bit, by its number."
    )
    enabled_mask: int = Field(0, ge=0, description="Bits of the status that show it is enabled.")
    enabled_value: int = Field(0, ge=0, description="Value of these bits while it is enabled.")
    ring: RingSettings | None = Field(None, description="The drive's own record of samples.")

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        check_block(self.read, "read")
        check_block(self.write, "write")
        self._check_functions()
        self._check_signs()
        self._check_faults()
        self._check_enabled_bits()
        self._check_ring_counters()
        self._check_control_words()
        self._check_word_sizes()
        return self

    @property
    def _control_words(self) -> dict[str, int]:
        words = {name: getattr(self, name) for name in ("enable", "disable", "halt", "fault_reset")}
        return {name: word for name, word in words.items() if word is not None}

    @property
    def _masks(self) -> dict[str, int]:
        return {"fault_mask": self.fault_mask, "enabled_mask": self.enabled_mask}

    def _check_functions(self) -> None:
        """Refuse blocks that cannot be read and written by their functions."""
        spans = [register.addresses for register in registers_of(self.write).values()]
        if self.write.function == 6:
            long = [name for name, one in registers_of(self.write).items() if one.registers > 1]
            if long:
                raise ValueError(
                    f"write.function: found 6, which writes one register, but {long[0]} takes more;"
                    " the drive would follow half a value. Set function = 16, or use a set-point of"
                    " one register"
                )
        if self.write.function != 23:
            return
        if self.read.function != 3:
            raise ValueError(
                "write.function: found 23, which reads holding registers, with read.function = 4;"
                " set write.function = 16"
            )
        if len(self.read_requests) > 1:
            raise ValueError(
                f"write.function: found 23, which reads one request, but read takes"
                f" {len(self.read_requests)}; set write.function = 16"
            )
        # Reading a gap is harmless. Writing 0 to an unknown register may change the drive's
        # settings.
        runs = requests_of(spans, 65536, across_gaps=False)
        if len(runs) > 1:
            raise ValueError(
                f"write: register {runs[0].stop} between {runs[0].start} and"
                f" {runs[-1].stop - 1} has no name, expected a block without gaps; set"
                " write.function = 16, which writes its parts one after another"
            )

    def _check_signs(self) -> None:
        """Refuse a set-point whose sign a drive could take before or after its magnitude."""
        for name, register in registers_of(self.write).items():
            if register.direction is not None:
                raise ValueError(
                    f"write.{name}.direction: found a sign in another register, expected a value"
                    " with its own sign; a drive could take one without the other"
                )

    @property
    def read_requests(self) -> list[range]:
        """The requests that read its block."""
        return read_requests(self.read)

    def _check_faults(self) -> None:
        for name, mask in self._masks.items():
            if mask and self.read.status is None:
                raise ValueError(
                    f"{name}: needs a status register; add read.status or leave the mask out"
                )
        for bit in self.faults:
            if not self.fault_mask >> bit & 1:
                raise ValueError(
                    f"faults: bit {bit} is not one of fault_mask 0x{self.fault_mask:04X}; add"
                    f" 0x{1 << bit:04X} to the mask, or leave the name out"
                )

    def _check_enabled_bits(self) -> None:
        """Refuse bits that do not distinguish an enabled drive from a disabled or faulty one."""
        if self.enabled_value & ~self.enabled_mask:
            raise ValueError(
                f"enabled_value: found 0x{self.enabled_value:04X}, expected bits of enabled_mask "
                f"0x{self.enabled_mask:04X} only; correct one of them"
            )
        # The default of 0 may be the value of a disabled drive, which would then count as enabled.
        if self.enabled_mask and "enabled_value" not in self.model_fields_set:
            raise ValueError(
                f"enabled_value: missing with enabled_mask 0x{self.enabled_mask:04X}; add the value"
                " of these bits while the drive is enabled, from its manual"
            )
        # An enabled drive would always report a fault, and no run could begin.
        both = self.enabled_value & self.fault_mask
        if both:
            raise ValueError(
                f"fault_mask: found 0x{self.fault_mask:04X}, but 0x{both:04X} of it is in"
                f" enabled_value 0x{self.enabled_value:04X}. An enabled drive has no fault"
            )
        # Otherwise every disabled drive, too, would report a fault.
        if self.enabled_mask and not self.enabled_mask & ~self.fault_mask:
            raise ValueError(
                f"enabled_mask: found 0x{self.enabled_mask:04X}, all of it in fault_mask"
                f" 0x{self.fault_mask:04X}. Expected a bit that no fault sets"
            )

    def _check_ring_counters(self) -> None:
        if self.ring is None:
            return
        counters = {"newest": self.ring.newest, "record.sequence": self.ring.record.sequence}
        for name, counter in counters.items():
            # Records are matched with exchanges by number, which needs equal wraparounds.
            if counter and counter.type != self.read.sequence.type:
                raise ValueError(
                    f"ring.{name}.type: found {counter.type}, expected {self.read.sequence.type} as"
                    " in read.sequence: it is the same counter"
                )

    def _check_control_words(self) -> None:
        words = self._control_words
        for word in repeated(words.values()):
            same = " and ".join(name for name, value in words.items() if value == word)
            raise ValueError(
                f"{same}: both are 0x{word:04X}, expected different control words; correct one"
            )

    def _check_word_sizes(self) -> None:
        """Refuse words and masks that do not fit into their registers."""
        for name, register, values in (
            ("write.control", self.write.control, self._control_words),
            ("read.status", self.read.status, self._masks),
        ):
            if register is None:
                continue
            check_counter(register, name)
            for key, value in values.items():
                if not register.holds(value, value):
                    raise ValueError(f"{key}: found 0x{value:X}, but {name} is a {register.type}")

    def active_faults(self, status: int) -> str:
        """Return the fault bits of a status word with their names; empty without a fault."""
        active = status & self.fault_mask
        if not active:
            return ""
        if not self.faults:
            return f"0x{active:04X}"
        bits = [bit for bit in range(active.bit_length()) if active >> bit & 1]
        names = ", ".join(self.faults.get(bit, f"bit {bit}") for bit in bits)
        return f"0x{active:04X}: {names}"


def read_requests(read: ReadBlock) -> list[range]:
    """Return the requests that read a block."""
    spans = [span for register in registers_of(read).values() for span in register.spans]
    return requests_of(spans, read.most_words, across_gaps=read.across_gaps)


class SensorMap(Settings):
    """Register map of a make of force sensors."""

    identity: tuple[Identity, ...] = Field((), description="Registers that identify the make.")
    read: SensorRead = Field(description="Block that is read.")

    @model_validator(mode="after")
    def _block_is_possible(self) -> Self:
        check_block(self.read, "read")
        return self


class Maps(Settings):
    """Register maps by name."""

    drive: dict[str, DriveMap] = Field(description="Maps of drives.")
    sensor: dict[str, SensorMap] = Field(default_factory=dict, description="Maps of force sensors.")
