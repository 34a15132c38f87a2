"""Torques that say nothing: one number in every row, as of a drive that was off or a channel that
is another's."""

from collections.abc import Sequence

from pipelines.contracts.joints import Joint, the
from pipelines.errors import InputError
from pipelines.mechanics.origin import settings_of
from pipelines.mechanics.run import Run


def silent_torque(runs: Sequence[Run], joint: Joint, value: float) -> InputError:
    """Return what is wrong with runs in which the torque (N·m or N) of a joint is one ``value`` all
    along."""
    return InputError(
        f"{', '.join(run.file for run in runs)}: the"
        f" {'torque' if joint.kind == 'revolute' else 'force'} of {the(joint.name)} is {value:.4g}"
        f" {joint.unit('torque')} in every row, expected what a drive exerts; check that it was on,"
        f" and which channel {settings_of(runs[0])} reads"
    )
