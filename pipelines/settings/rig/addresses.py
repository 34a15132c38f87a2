"""Where the devices of a rig are: the lines and the register maps that they name."""

from collections.abc import Iterable, Mapping, Sequence

from pydantic.main import IncEx

from pipelines.settings.base import Settings
from pipelines.settings.rig.devices import DeviceSettings
from pipelines.settings.rig.line import LineSettings, TcpLine


def line_of(device: DeviceSettings, lines: Mapping[str, LineSettings]) -> LineSettings:
    """Return the line that a device is on: a shared one, else its own by TCP."""
    if device.line is None:
        return TcpLine(host=device.host, port=device.port)
    return lines[device.line]


def check_maps(maps: Settings, **devices: Sequence[DeviceSettings]) -> None:
    """Refuse a device whose register map is missing.

    Parameters
    ----------
    maps : Settings
        The tables below ``[map]``.
    **devices : sequence of DeviceSettings
        Devices of each kind of map.

    Raises
    ------
    ValueError
        Names the device's key and the maps that there are.
    """
    for kind, of_kind in devices.items():
        known = getattr(maps, kind)
        for i, device in enumerate(of_kind):
            if device.map not in known:
                raise ValueError(
                    f"{kind}[{i}].map: found {device.map!r}, expected a table below"
                    f" [map.{kind}]: {', '.join(known) or 'there is none'}"
                )


def check_named_lines(devices: Iterable[DeviceSettings], lines: Mapping[str, LineSettings]) -> None:
    """Refuse a device whose line is missing.

    Raises
    ------
    ValueError
        Names the line, the device's unit and the lines that there are.
    """
    for device in devices:
        if device.line is not None and device.line not in lines:
            raise ValueError(
                f"line: found {device.line!r} at unit {device.unit}, expected a table below"
                f" [line]: {', '.join(lines) or 'there is none'}"
            )


def secret_files(lines: Mapping[str, LineSettings]) -> IncEx:
    """Return the keys of lines that name files, such as keys of TLS: no recording carries them."""
    return {name: set(line.files) for name, line in lines.items()}
