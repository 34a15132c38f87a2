"""A line: the connection that one device or several share, by TCP, RTU on a serial port, RTU over
TCP or TLS."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from pipelines.errors import SettingsError
from pipelines.settings.base import Settings

FIXED_SILENCE_BAUD, FIXED_SILENCE_S = 19200, 0.00175
"""Above this rate the silence between two RTU frames is a fixed time, no longer 3.5 characters
("Modbus over serial line specification and implementation guide" V1.02, 2.5.1.1)."""


class Line(Settings):
    """What lines of every kind have."""

    has_transaction_ids: ClassVar[bool] = True
    """Whether a reply names the request that it answers; among RTU frames none does."""

    @property
    def files(self) -> dict[str, Path]:
        """Files that it needs, by key."""
        return {}

    def with_files_in(self, folder: Path) -> Self:
        """Return the line with its files as seen from a rig file in a folder."""
        return self.model_copy(update={key: folder / file for key, file in self.files.items()})


class NetworkLine(Line):
    """A line to a host."""

    host: str = Field(
        "127.0.0.1", description="Name or address; an embedded rig is always on this machine."
    )
    port: int = Field(
        502, ge=1, le=65535, description="TCP port; an embedded rig chooses a free one."
    )
    silence_s: float = Field(
        0.0, ge=0.0, description="Quiet time before each request, for a gateway that needs it."
    )

    @property
    def place(self) -> str:
        """Where it leads."""
        return f"{self.host}:{self.port}"

    def at(self, place: str) -> Self:
        """Return the line with another place."""
        host, _, port = place.rpartition(":")
        return self.model_copy(update={"host": host, "port": int(port)})

    @property
    def quiet_s(self) -> float:
        """Quiet time before each request, s."""
        return self.silence_s

    def exchange_s(self, characters: int) -> float:
        """Return the least time that a request and its reply take, s; what a network takes is not
        known."""
        return self.quiet_s


class TcpLine(NetworkLine):
    """Modbus TCP."""

    transport: Literal["tcp"] = "tcp"


class RtuOverTcpLine(NetworkLine):
    """RTU frames through a TCP connection, as a serial device server passes them on."""

    has_transaction_ids = False
    transport: Literal["rtu_over_tcp"]


class TlsLine(NetworkLine):
    """Modbus TCP Security: the same frames, encrypted, between peers that show certificates."""

    transport: Literal["tls"]
    port: int = Field(
        802, ge=1, le=65535, description="TCP port; an embedded rig chooses a free one."
    )
    ca: Path | None = Field(
        None, description="Certificates that the device's is checked with; else the system's."
    )
    certificate: Path | None = Field(
        None, description="What exoid shows a device that asks who it is."
    )
    key: Path | None = Field(None, description="The key to it, without a passphrase.")
    rig_certificate: Path | None = Field(None, description="What a virtual rig shows.")
    rig_key: Path | None = Field(None, description="The key to that.")

    @model_validator(mode="after")
    def _has_both_halves(self) -> Self:
        for certificate, key in (("certificate", "key"), ("rig_certificate", "rig_key")):
            if (getattr(self, certificate) is None) != (getattr(self, key) is None):
                raise ValueError(f"{certificate} and {key} belong together; give both or neither")
        return self

    @property
    def files(self) -> dict[str, Path]:
        """Files that it needs, by key."""
        names = ("ca", "certificate", "key", "rig_certificate", "rig_key")
        return {name: file for name in names if (file := getattr(self, name)) is not None}


def refuse_passphrase(key: Path | None) -> Callable[[], str]:
    """Return what refuses a key that wants a passphrase: whoever asked for one would hold up a
    moving leg."""

    def refuse() -> str:
        raise SettingsError(
            f"{key}: is protected by a passphrase, expected a key without one, as nobody is asked"
            f" while a leg moves; `openssl pkey -in {key} -out FILE` makes one, to be kept where"
            " nobody else may read it"
        )

    return refuse


class RtuLine(Line):
    """Modbus RTU on a serial port."""

    has_transaction_ids = False
    transport: Literal["rtu"]
    serial_port: str = Field(
        min_length=1, description="Path of the port, best one below /dev/serial/by-id."
    )
    baud_rate: int = Field(19200, ge=300, description="Bits a second.")
    parity: Literal["even", "odd", "none"] = Field("even", description="Parity bit.")
    stop_bits: Literal[1, 2] = Field(
        1, description="Stop bits; 2 where there is no parity, as the standard has it."
    )
    silence_s: float | None = Field(
        None,
        ge=0.0,
        description="Quiet time before each frame; else the standard's, 3.5 characters or 1.75 ms.",
    )

    @property
    def place(self) -> str:
        """Where it leads."""
        return self.serial_port

    def at(self, place: str) -> Self:
        """Return the line on a virtual rig's pseudo-terminal."""
        # Characters travel whole there: it knows no parity, and refuses to be set up with one.
        return self.model_copy(update={"serial_port": place, "parity": "none"})

    @property
    def character_s(self) -> float:
        """Time that a character takes: a start bit, 8 of data, parity and stop bits."""
        return (9 + (self.parity != "none") + self.stop_bits) / self.baud_rate

    @property
    def quiet_s(self) -> float:
        """Quiet time before each frame, s."""
        if self.silence_s is not None:
            return self.silence_s
        return 3.5 * self.character_s if self.baud_rate <= FIXED_SILENCE_BAUD else FIXED_SILENCE_S

    def exchange_s(self, characters: int) -> float:
        """Return the least time that a request and its reply take, ``characters`` long together,
        s."""
        return characters * self.character_s + 2 * self.quiet_s


LineSettings = Annotated[
    TcpLine | RtuLine | RtuOverTcpLine | TlsLine, Field(discriminator="transport")
]
