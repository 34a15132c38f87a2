"""The ring or queue in which a drive keeps its latest samples."""

from typing import Self

from pydantic import Field, model_validator

from pipelines.settings.base import Settings
from pipelines.settings.rig.block import (
    MOST_REGISTERS,
    ReadSettings,
    check_block,
    check_counter,
    registers_of,
)
from pipelines.settings.rig.register import Register

# "MODBUS application protocol specification" V1.1b3, section 6.18.
MOST_QUEUED = 31
"""Registers that one FC24 answer carries."""


class RingRecord(Settings):
    """One record of a ring; addresses count from the record's own beginning."""

    sequence: Register = Field(description="Sample counter, which counts as read.sequence does.")
    time: Register = Field(description="The device's clock at the sample.")
    angle: Register = Field(description="Joint angle.")
    current: Register = Field(description="Motor current, positive if it increases the angle.")
    velocity: Register | None = Field(None, description="The drive's own velocity estimate.")
    reference: Register | None = Field(None, description="Set-point in force.")


class RingSettings(ReadSettings):
    """A ring of registers, or a queue read by FC24."""

    newest: Register | None = Field(None, description="Of a ring: number of the newest record.")
    address: int | None = Field(None, ge=0, le=65535, description="Of a ring: place of record 0.")
    capacity: int | None = Field(None, ge=2, description="Of a ring: number of its records.")
    fifo: int | None = Field(None, ge=0, le=65535, description="Of a queue: its address for FC24.")
    words: int = Field(ge=1, le=MOST_REGISTERS["read"], description="Registers of each record.")
    record: RingRecord = Field(description="Registers of a record.")

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        check_block(self.record, "record")
        self._check_kind()
        registers = registers_of(self.record).values()
        length = max(span.stop for register in registers for span in register.spans)
        if length > self.words:
            raise ValueError(
                f"words: found {self.words}, but the record's registers take {length}; correct one"
            )
        if self.words > self.most_words:
            raise ValueError(
                f"words: found {self.words}, more than most_words ({self.most_words}); a request"
                " must bring a whole record"
            )
        # An answer removes its records from the queue, so a record must fit into one answer.
        if self.fifo is not None and self.words > MOST_QUEUED:
            raise ValueError(
                f"words: found {self.words}, expected at most {MOST_QUEUED} for an FC24 answer"
            )
        if self.newest is not None:
            check_counter(self.newest, "newest")
            self._check_ring(self.newest)
        return self

    @property
    def records_per_read(self) -> int:
        """Greatest number of records that one read returns."""
        return (self.most_words if self.fifo is None else MOST_QUEUED) // self.words

    def _check_kind(self) -> None:
        """Refuse all but the keys of a ring, or of a queue."""
        names = ("address", "capacity", "fifo", "newest")
        given = [name for name in names if getattr(self, name) is not None]
        if given not in (["address", "capacity", "newest"], ["fifo"]):
            raise ValueError(
                f"ring: found {', '.join(given) or 'neither'}, expected newest, address and"
                " capacity (a ring that FC03 reads), or fifo (a queue that FC24 reads)"
            )

    def _check_ring(self, newest: Register) -> None:
        assert self.address is not None and self.capacity is not None  # a ring has all three
        end = self.address + self.capacity * self.words
        if end > 65536:
            raise ValueError(
                f"capacity: found {self.capacity}, but such a ring ends beyond address 65535"
            )
        if self.address < newest.address + newest.registers and newest.address < end:
            raise ValueError(
                f"newest: register {newest.address} is part of the ring itself; correct one address"
            )
        for name, register in (("newest", newest), ("record.sequence", self.record.sequence)):
            # A record must keep its place in the ring when the counter wraps around.
            counts = register.counts if register.is_unsigned else None
            if counts is None or (counts[1] + 1) % self.capacity:
                raise ValueError(
                    f"{name}.type: found {register.type} with a capacity of {self.capacity},"
                    " expected an unsigned counter and a power of 2"
                )
