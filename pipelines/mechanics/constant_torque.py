"""Report a constant torque: a drive that was off, or a channel of something else."""

from collections.abc import Sequence

from pipelines.contracts.joints import Joint, the
from pipelines.errors import InputError
from pipelines.mechanics.remedies import settings_of
from pipelines.mechanics.run import Run


def constant_torque(runs: Sequence[Run], joint: Joint, value: float) -> InputError:
    """Return the error for runs in which a joint's torque never changes.

    Parameters
    ----------
    runs : sequence of Run
        The runs to name.
    joint : Joint
        The joint.
    value : float
        Its torque, N·m, or force, N.

    Returns
    -------
    InputError
        To be raised.
    """
    passive = '; a joint without a drive has drive = "none"' if value == 0.0 else ""
    return InputError(
        f"{', '.join(run.file for run in runs)}: the"
        f" {'torque' if joint.kind == 'revolute' else 'force'} of {the(joint.name)} is {value:.4g}"
        f" {joint.unit('torque')} in every row, expected one that varies. Check that the drive was"
        f" on, and which channel {settings_of(runs[0])} reads{passive}"
    )
