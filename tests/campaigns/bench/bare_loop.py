"""What an acquisition cycle cannot be faster than here: its pymodbus calls, and nothing made of the
answers."""

import asyncio
import time

from pymodbus.client import AsyncModbusTcpClient

from pipelines.modbus.register_block import Block
from pipelines.settings.rig import RigSettings
from pipelines.settings.rig.block import registers_of
from pipelines.settings.rig.devices import DeviceSettings

CYCLES = 1500


def cycles_a_second(rig: RigSettings) -> float:
    """Read all sensors side by side, then exchange all drives side by side, again and again."""
    return asyncio.run(_cycles_a_second(rig))


async def _cycles_a_second(rig: RigSettings) -> float:
    drives = [
        (await _connected(drive), drive.unit, *_blocks(rig, drive.map)) for drive in rig.drive
    ]
    sensors = [
        (
            await _connected(sensor),
            sensor.unit,
            Block(registers_of(rig.map.sensor[sensor.map].read)),
        )
        for sensor in rig.sensor
    ]
    began = time.perf_counter()
    for _ in range(CYCLES):
        await asyncio.gather(
            *(
                client.read_holding_registers(read.address, count=read.count, device_id=unit)
                for client, unit, read in sensors
            )
        )
        await asyncio.gather(
            *(
                client.readwrite_registers(
                    read_address=read.address,
                    read_count=read.count,
                    write_address=write.address,
                    values=[0] * write.count,
                    device_id=unit,
                )
                for client, unit, read, write in drives
            )
        )
    rate = CYCLES / (time.perf_counter() - began)
    for client, *_ in (*drives, *sensors):
        client.close()
    return rate


async def _connected(device: DeviceSettings) -> AsyncModbusTcpClient:
    client = AsyncModbusTcpClient(
        device.host, port=device.port, timeout=5.0, retries=0, reconnect_delay=0
    )
    assert await client.connect()
    return client


def _blocks(rig: RigSettings, name: str) -> tuple[Block, Block]:
    registers = rig.map.drive[name]
    return Block(registers_of(registers.read)), Block(registers_of(registers.write))
