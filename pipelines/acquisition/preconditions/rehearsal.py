"""A rehearsal of a run's cycles, which only reads, to see whether they are fast enough.

The latency of devices and computer is unknown before it is measured, and a set-point that is left
out jerks the leg. So the rehearsal is made while the drives are still disabled.
"""

from math import ceil

from pipelines.acquisition.machine.machine import Machine, all_answers
from pipelines.acquisition.machine.sampling import sources_of
from pipelines.acquisition.pacing import PhaseLock
from pipelines.errors import DeviceError


async def refuse_unkept_rate(machine: Machine, cycle_hz: float) -> None:
    """Refuse a rate of set-points that the cycles cannot keep; call it after ``machine.look``.

    Raises
    ------
    DeviceError
        Gives the number of late cycles.
    """
    # Largest allowed share of late cycles: the computer may be busy for a moment.
    most_late = 0.1
    rehearsed_s, fewest = 0.5, 20
    cycles = max(fewest, ceil(rehearsed_s * cycle_hz))
    allowed = most_late * cycles
    late, done = await _late(machine, cycle_hz, cycles, allowed)
    if late <= allowed:
        return
    less_often = ", raise `every` of the sensors" if machine.sensors else ""
    raise DeviceError(
        f"{late} of {done} cycles with all devices took longer than the"
        f" {1e3 / cycle_hz:g} ms from one set-point to the next; lower"
        f" acquire.sample_rate_hz{less_often}, or close other programs; nothing was moved"
    )


async def _late(machine: Machine, cycle_hz: float, cycles: int, allowed: float) -> tuple[int, int]:
    """Make cycles as in a run in real time; return the number of late ones and of all."""
    pace = PhaseLock(cycle_hz, machine.count, machine.rig.safety.watchdog_s)
    sources = sources_of(machine, cycle_hz)
    late, done, last = 0, 0, await machine.count()
    # With very slow devices, all cycles would take minutes.
    while done < cycles and late <= allowed:
        count = await pace.wait(last)
        # A counter that went on by more than one has let a sample go by.
        late += count > last + 1
        last = count
        # With reads in place of exchanges, so that nothing is written.
        row = (await machine.cycle(done, lambda drive: drive.look(in_motion=True))).row
        done += 1
        if row and sources:
            await all_answers(
                source.samples(reading) for source, reading in zip(sources, row.drives, strict=True)
            )
    for source in sources:
        await source.pending.result()
    return late, done
