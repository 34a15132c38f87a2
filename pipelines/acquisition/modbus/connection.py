"""The pymodbus client of a line, and the errors of its connection in words."""

import errno
import socket
import ssl
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient, AsyncModbusTlsClient
from pymodbus.client.base import ModbusBaseClient
from pymodbus.framer import FramerType
from serial.tools import list_ports

from pipelines.errors import SettingsError
from pipelines.settings.rig.line import (
    LineSettings,
    RtuLine,
    RtuOverTcpLine,
    TlsLine,
    refuse_passphrase,
)


def client_of(
    settings: LineSettings,
    tls: ssl.SSLContext | None,
    timeout_s: float,
    note: Callable[[bool], None],
) -> ModbusBaseClient:
    """Return the client of a line, not yet connected."""
    # Without retries: a set-point that comes late is wrong by then.
    # Nor does pymodbus connect again by itself: that takes long, and other drives may be moving.
    common: Mapping[str, Any] = {
        "timeout": timeout_s,
        "retries": 0,
        "reconnect_delay": 0,
        "trace_connect": note,
    }
    if isinstance(settings, RtuLine):
        return AsyncModbusSerialClient(
            settings.serial_port,
            baudrate=settings.baud_rate,
            parity=settings.parity[0].upper(),
            stopbits=settings.stop_bits,
            **common,
        )
    if isinstance(settings, TlsLine):
        assert tls  # a TLS line has a context
        return AsyncModbusTlsClient(settings.host, port=settings.port, sslctx=tls, **common)
    framer = FramerType.RTU if isinstance(settings, RtuOverTcpLine) else FramerType.SOCKET
    return AsyncModbusTcpClient(settings.host, port=settings.port, framer=framer, **common)


def tls_context(settings: TlsLine) -> ssl.SSLContext:
    """Return the certificate of a line and the authorities that it trusts, as a TLS context.

    Raises
    ------
    SettingsError
        A file is not a usable certificate or key.
    """
    file: Path | None = settings.ca
    try:
        context = ssl.create_default_context(cafile=settings.ca)
        if settings.certificate:
            file = settings.certificate
            context.load_cert_chain(
                settings.certificate, settings.key, refuse_passphrase(settings.key)
            )
    except OSError as error:  # SSLError is one
        raise SettingsError(
            f"{file}: is not a usable certificate ({error.strerror or error})"
        ) from error
    return context


def explain(error: OSError) -> str:
    """Return a failure to connect in words, with a remedy."""
    if isinstance(error, socket.gaierror):
        return f"no such host ({error.strerror}); correct host in the rig file, or give its address"
    if isinstance(error, ssl.SSLCertVerificationError):
        reason = error.verify_message.rstrip(".")
        return f"its certificate is not trusted ({reason}); check ca, host and both clocks"
    if isinstance(error, TimeoutError):
        return "no TLS connection within safety.connect_s; check that rig and port speak TLS"
    if isinstance(error, ssl.SSLError):
        return f"no TLS connection ({error.reason or error}); check port, certificate and key"
    if error.errno == errno.ENOENT:
        there = ", ".join(sorted(port.device for port in list_ports.comports())) or "none"
        return f"no such serial port; there is {there}; plug the adapter in, or correct serial_port"
    if error.errno in (errno.EACCES, errno.EPERM):
        return "no permission for the serial port; on Linux run `sudo usermod -aG dialout $USER`"
    if error.errno in (errno.EBUSY, errno.EAGAIN):
        return "the serial port is busy; end the other program that uses it"
    return f"no connection ({error}); check that the rig is on, and the line in the rig file"
