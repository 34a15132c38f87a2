"""Protection of a virtual rig against hostile or faulty clients."""

from collections.abc import Collection, Mapping
from typing import TypeVar

from pymodbus.constants import ExcCodes
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from pymodbus.server.base import ModbusBaseServer
from pymodbus.server.requesthandler import ServerRequestHandler

Server = TypeVar("Server", bound=ModbusBaseServer)


Functions = Mapping[int, Collection[int]]
"""Function codes that each unit knows."""


class NoRequest(ModbusPDU):
    """A frame that is no valid request; it gets the exception reply of the specification."""

    def __init__(self, function: int, functions: Functions) -> None:
        super().__init__()
        self._functions = functions
        # Bit 7 marks an exception reply, which pymodbus sets in the reply itself.
        self.function_code = function & 0x7F

    async def datastore_update(self, context: object, device_id: int) -> ModbusPDU:
        """Refuse the request: for its function, which comes first, or for its content."""
        known = self._functions.get(device_id, (self.function_code,))
        code = ExcCodes.ILLEGAL_VALUE if self.function_code in known else ExcCodes.ILLEGAL_FUNCTION
        return ExceptionResponse(self.function_code, code)


class Handler(ServerRequestHandler):
    """The rig's end of one connection."""

    def pause_writing(self) -> None:
        """Close the connection of a client that does not read its replies, which would pile up."""
        self.transport.abort()  # type: ignore[attr-defined]  # pymodbus declares the base of all transports

    def resume_writing(self) -> None:
        """Do nothing: the connection of a slow client was closed."""

    def callback_data(self, data: bytes, addr: tuple | None = None) -> int:
        """Process received bytes; discard those in which no frame can be found."""
        try:
            return super().callback_data(data, addr)
        except Exception:  # asyncio would print it and close the line for all devices on it
            return len(data)

    async def handle_request(self) -> None:
        """Answer a request; for a missing unit as a gateway does."""
        request = self.last_pdu
        if request is None or request.dev_id in self.server.context.device_ids():
            await super().handle_request()
        # On a bus a missing unit is silent; a gateway reports it.
        elif not self.server.ignore_missing_devices:
            self.server_send(
                ExceptionResponse(
                    request.function_code,
                    ExcCodes.GATEWAY_NO_RESPONSE,
                    request.dev_id,
                    request.transaction_id,
                ),
                self.last_addr,
            )


def guarded(server: Server, functions: Functions) -> Server:
    """Return a server that no client can stop or let grow without bounds."""
    # Where this is None, pymodbus replies to function 0, and drops all bytes that came with the
    # frame.
    decode = server.decoder.decode
    server.decoder.decode = lambda frame: decode(frame) or NoRequest(frame[0], functions)  # type: ignore[method-assign]
    connection = (server.trace_packet, server.trace_pdu, server.trace_connect)
    server.callback_new_connection = lambda: Handler(server, *connection)  # type: ignore[method-assign]
    return server
