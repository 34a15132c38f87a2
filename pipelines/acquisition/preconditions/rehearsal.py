"""Whether the cycles of a run to come follow one another fast enough, tried with every device,
telling none anything.

How long answers take is known of neither a device nor a computer before it was tried, and a
set-point that is left out jerks a leg. So it is tried while the drives are disabled still.
"""

from math import ceil

from pipelines.acquisition.machine.drive import Drive, Reading
from pipelines.acquisition.machine.machine import Machine, all_answers
from pipelines.acquisition.machine.sampling import sources_of
from pipelines.acquisition.pacing import PhaseLock
from pipelines.errors import DeviceError

REHEARSED_S, FEWEST = 0.5, 20
"""How long it is tried, and the fewest cycles that takes."""
MOST_LATE = 0.1
"""Share of late cycles beyond which no run is begun: a computer may be busy with something else for
a moment."""


async def refuse_unkept_rate(machine: Machine, cycle_hz: float) -> None:
    """Refuse set-points more often than cycles can follow one another, after ``machine.look``;
    nothing is written.

    Raises
    ------
    DeviceError
        Tells how many cycles came late.
    """
    cycles = max(FEWEST, ceil(REHEARSED_S * cycle_hz))
    allowed = MOST_LATE * cycles
    late, cycles_made = await _late(machine, cycle_hz, cycles, allowed)
    if late <= allowed:
        return
    less_often = ", raise `every` of the sensors" if machine.sensors else ""
    raise DeviceError(
        f"{late} of {cycles_made} cycles in which every device was asked took longer than the"
        f" {1e3 / cycle_hz:g} ms from one set-point to the next; lower"
        f" acquire.sample_rate_hz{less_often}, or close what else this computer does; nothing was"
        " moved"
    )


async def _late(machine: Machine, cycle_hz: float, cycles: int, allowed: float) -> tuple[int, int]:
    """Make cycles as a run in real time does, until more than allowed let a sample go by; return
    those, and all.

    Where answers take longer than a cycle, none may come before its time is up: all of them would
    take minutes.
    """
    pace = PhaseLock(cycle_hz, machine.count, machine.rig.safety.watchdog_s)
    sources = sources_of(machine, cycle_hz)
    late, done, last = 0, 0, await machine.count()
    while done < cycles and late <= allowed:
        count = await pace.wait(last)
        late += count > last + 1
        last = count
        row = (await machine.cycle(done, _look)).row
        done += 1
        if row and sources:
            await all_answers(
                source.samples(reading) for source, reading in zip(sources, row.drives, strict=True)
            )
    for source in sources:
        await source.pending.brought()
    return late, done


async def _look(drive: Drive) -> Reading:
    return await drive.look(in_motion=True)
