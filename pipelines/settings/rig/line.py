"""A line: the connection that devices share, by TCP, RTU on a serial port, RTU over TCP or TLS."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from pipelines.errors import SettingsError
from pipelines.settings.base import NotNegative, Settings


class Line(Settings):
    """Settings of lines of every kind."""

    has_transaction_ids: ClassVar[bool] = True
    """Whether replies carry the identifier of their request; RTU frames have none."""

    @property
    def files(self) -> dict[str, Path]:
        """Files that it needs, by key."""
        return {}

    def with_files_in(self, folder: Path) -> Self:
        """Return the line with the paths of its files relative to the folder of a rig file."""
        return self.model_copy(update={key: folder / file for key, file in self.files.items()})


class NetworkLine(Line):
    """A line to a host."""

    host: str = Field("127.0.0.1", description="Name or address; an embedded rig has its own.")
    port: int = Field(502, ge=1, le=65535, description="TCP port; an embedded rig chooses its own.")
    silence_s: NotNegative = Field(0.0, description="Quiet time that a gateway may need.")

    @property
    def place(self) -> str:
        """Host and port."""
        return f"{self.host}:{self.port}"

    def at(self, place: str) -> Self:
        """Return the line with another host and port."""
        # From the right, as an IPv6 address has colons of its own.
        host, _, port = place.rpartition(":")
        return self.model_copy(update={"host": host, "port": int(port)})

    @property
    def quiet_s(self) -> float:
        """Quiet time before each request, s."""
        return self.silence_s

    def exchange_s(self, characters: int) -> float:
        """Return the least time of a request and its reply, s; that of the network is unknown.

        Parameters
        ----------
        characters : int
            Of both together.
        """
        return self.quiet_s


class TcpLine(NetworkLine):
    """Modbus TCP."""

    transport: Literal["tcp"] = Field(
        "tcp", description="tcp, nothing else; a [line] table must state it."
    )


class RtuOverTcpLine(NetworkLine):
    """RTU frames through a TCP connection, as of a serial device server."""

    has_transaction_ids = False
    transport: Literal["rtu_over_tcp"] = Field(description="rtu_over_tcp, nothing else.")


class TlsLine(NetworkLine):
    """Modbus TCP Security: encrypted frames between peers with certificates."""

    transport: Literal["tls"] = Field(description="tls, nothing else.")
    port: int = Field(802, ge=1, le=65535, description="TCP port; an embedded rig chooses its own.")
    ca: Path | None = Field(None, description="Checks the device's certificate; else the system.")
    certificate: Path | None = Field(None, description="exoid's, for devices that ask for one.")
    key: Path | None = Field(None, description="Its private key, without a passphrase.")
    rig_certificate: Path | None = Field(None, description="Certificate of a virtual rig.")
    rig_key: Path | None = Field(None, description="Private key of the virtual rig.")

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
        paths = {name: getattr(self, name) for name in names}
        return {name: path for name, path in paths.items() if path is not None}


def refuse_passphrase(key: Path | None) -> Callable[[], str]:
    """Return a callback that refuses a key with a passphrase, for which OpenSSL would block."""

    def refuse() -> str:
        raise SettingsError(
            f"{key}: is protected by a passphrase, expected a key without one."
            f" `openssl pkey -in {key} -out FILE` makes one; keep it private"
        )

    return refuse


class RtuLine(Line):
    """Modbus RTU on a serial port."""

    has_transaction_ids = False
    transport: Literal["rtu"] = Field(description="rtu, nothing else.")
    serial_port: str = Field(min_length=1, description="Its path, best below /dev/serial/by-id.")
    baud_rate: int = Field(19200, ge=300, description="Bits a second.")
    parity: Literal["even", "odd", "none"] = Field("even", description="Parity bit.")
    stop_bits: Literal[1, 2] = Field(1, description="Stop bits; 2 is the standard without parity.")
    silence_s: NotNegative | None = Field(
        None, description="Quiet time before each frame; else the standard's."
    )

    @property
    def place(self) -> str:
        """Path of its port."""
        return self.serial_port

    def at(self, place: str) -> Self:
        """Return the line on the pseudo-terminal of a virtual rig."""
        # A pseudo-terminal has no parity, and refuses to be set up with one.
        return self.model_copy(update={"serial_port": place, "parity": "none"})

    @property
    def _character_s(self) -> float:
        """Time of a character, s: a start bit, 8 data bits, parity and stop bits."""
        return (9 + (self.parity != "none") + self.stop_bits) / self.baud_rate

    @property
    def quiet_s(self) -> float:
        """Quiet time before each frame, s."""
        # Above this rate the silence between RTU frames is a fixed time, else 3.5 characters.
        # Source: "Modbus over serial line specification and implementation guide" V1.02, 2.5.1.1.
        fixed_silence_baud, fixed_silence_s = 19200, 0.00175
        if self.silence_s is not None:
            return self.silence_s
        return 3.5 * self._character_s if self.baud_rate <= fixed_silence_baud else fixed_silence_s

    def exchange_s(self, characters: int) -> float:
        """Return the least time of a request and its reply, s.

        Parameters
        ----------
        characters : int
            Of both together.
        """
        # One silence before the request, one before the reply.
        return characters * self._character_s + 2 * self.quiet_s


LineSettings = Annotated[
    TcpLine | RtuLine | RtuOverTcpLine | TlsLine, Field(discriminator="transport")
]


def with_files_near(lines: Mapping[str, LineSettings], rig_file: Path) -> dict[str, LineSettings]:
    """Return lines with the paths of their files relative to the folder of a rig file."""
    return {name: line.with_files_in(rig_file.parent) for name, line in lines.items()}


def check_unit(unit: int, line: LineSettings, name: str | None) -> None:
    """Refuse a unit that a line cannot address.

    Raises
    ------
    ValueError
        Names the unit and the line.
    """
    # "Modbus over serial line" V1.02, 2.2: 0 is for all devices at once, 248 to 255 are reserved.
    if not line.has_transaction_ids and not 1 <= unit <= 247:
        raise ValueError(
            f"unit: found {unit} on line {name}, expected 1 to 247 in RTU frames; 0 and 248 to 255"
            " are for Modbus TCP alone"
        )
