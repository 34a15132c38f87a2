"""Servers that take one client: devices with connections of their own then share one."""

from collections.abc import Awaitable, Callable, Iterable

from pipelines.acquisition.modbus.device import Device
from pipelines.errors import DeviceError, Disconnected, Refused, Unanswered


async def greet(
    device: Device, earlier: Iterable[Device], ask: Callable[[], Awaitable[None]]
) -> None:
    """Connect a device and ask it something; share an earlier connection where the server needs it.

    Nothing moves yet, so a lost answer costs time only.

    Parameters
    ----------
    device : Device
        On a line that may be closed yet.
    earlier : iterable of Device
        Those that were greeted before.
    ask : callable
        Reads something from the device.

    Raises
    ------
    DeviceError
        It does not answer on any connection, or refuses.
    """
    others = [
        other
        for other in earlier
        if other.line is not device.line and other.line.place == device.line.place
    ]
    shared = next((other.line for other in others if other.line.has_answered), None)
    if shared and shared.takes_one_client:
        device.move(shared)
        return await ask()
    own = device.line
    try:
        await own.connect()
        await ask()
    except (Unanswered, Disconnected) as error:
        # Other faults are none of a server that serves another client.
        if shared is None:
            raise
        own.close()
        device.move(shared)
        try:
            await ask()
        except Refused:
            raise
        except DeviceError:
            device.move(own)
            raise error from None
        shared.takes_one_client = True
        return
    # Some servers serve the newest client, and end the connection of the one before. Others end
    # each connection after an answer, which a second request on this one shows.
    if shared and not shared.client.connected:
        await ask()
        if not own.closes:
            own.takes_one_client = True
            for other in others:
                other.move(own)
