"""``exoid rig serve``: a virtual rig on this machine, to be recorded like a real one."""

import socket
from contextlib import ExitStack
from ipaddress import ip_address
from pathlib import Path
from typing import Annotated, Literal

import typer

from exoid_cli.console import console
from pipelines.errors import SettingsError


def serve(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="The rig's description, with a [plant].")
    ],
    run: Annotated[
        Literal["exo_alone", "with_human"], typer.Option(help="Whether a person is in the machine.")
    ] = "with_human",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the noise.")] = 0,
    port: Annotated[
        int | None,
        typer.Option(
            min=0, max=65535, help="One port for all devices, 0 for a free one; else the file's."
        ),
    ] = None,
    sample_rate_hz: Annotated[
        float | None,
        typer.Option(
            "--rate-hz",
            "--sample-rate-hz",
            min=1.0,
            max=1e5,
            help="Samples a second; else the plant's.",
        ),
    ] = None,
    bind: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    anyone: Annotated[
        bool, typer.Option("--anyone", help="Allow a --bind that other computers can reach.")
    ] = False,
    until_input_ends: Annotated[
        bool, typer.Option(hidden=True, help="Stop when standard input is closed.")
    ] = False,
) -> None:
    """Serve the drives and force sensors of a virtual rig over Modbus, until Ctrl-C.

    \b
    Example:
      exoid rig serve rigs/real_time.toml --run exo_alone --port 5020
    """
    bind = _address(bind, anyone)
    announced, starting = False, ExitStack()

    def announce(address: str, line: str | None) -> None:
        nonlocal announced
        # The first address is known once the start is over.
        starting.close()
        if not announced and not until_input_ends:
            console.say(f"{file}: a virtual rig, {run}; Ctrl-C ends it")
            announced = True
        # In every mode: the program that started the rig waits for this line.
        print(f"{line} {address}" if line else address, flush=True)

    with starting:
        if not until_input_ends:
            what = f"starting {file.name}; the first start compiles, up to a minute"
            starting.enter_context(console.starting(what))
        from pipelines.rig.server import serve_file  # compiles already

        serve_file(
            file,
            run,
            seed,
            port,
            sample_rate_hz,
            announce,
            until_input_ends=until_input_ends,
            bind=bind,
        )


def _address(bind: str, anyone: bool) -> str:
    """Return the address to listen on; one that other computers reach needs ``anyone``."""
    addresses = _addresses(bind)
    # All of them: a name may stand for a loopback address and an open one.
    if addresses and all(ip_address(address).is_loopback for address in addresses):
        return addresses[0]  # not the name, which may be resolved differently the next time
    if not anyone:
        raise SettingsError(
            f"--bind: found {bind}, expected an address that only this computer reaches, such as"
            " 127.0.0.1. Modbus has no authentication: add --anyone if any computer may move the"
            " rig"
        )
    console.warn(
        f"the rig listens on {bind}, and Modbus has no authentication: every computer that reaches"
        " it can move it"
    )
    return bind


def _addresses(bind: str) -> list[str]:
    """Return the addresses of a host name, IPv4 first as in rig files; empty if unknown."""
    try:
        known = socket.getaddrinfo(bind, None, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return []
    ipv4_first = sorted(known, key=lambda entry: entry[0] != socket.AF_INET)
    return [str(address[0]) for *_, address in ipv4_first]
