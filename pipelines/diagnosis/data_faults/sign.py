"""Find a reversed sign at a machine of one joint.

With a reversed sign the torque is that of a body of negative inertia, whose friction drives it. A
stiff spring or a late torque can make an inertia look negative. Only a wrong sign also makes
friction supply energy, so both must be significant. No equation shows whether torque or angle has
the wrong sign.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts.fault_kind import FaultKind
from pipelines.contracts.joints import the
from pipelines.diagnosis.data_faults.fault import Fault, column
from pipelines.diagnosis.data_faults.proof import by_motion
from pipelines.diagnosis.evidence.baseline import Baseline, baseline_of
from pipelines.diagnosis.evidence.baseline_columns import columns_under
from pipelines.diagnosis.evidence.observed_run import Run, observe
from pipelines.estimation.long_run import long_run_covariance
from pipelines.estimation.regression import by_segment
from pipelines.estimation.sandwich import sandwich
from pipelines.mechanics.mechanisms.single import PENDULUM
from pipelines.mechanics.motion import Motion
from pipelines.mechanics.remedies import how_to_correct

LEAST_BLOCKS = 50
"""Fewest averages from which an interval is estimated."""


def sign_faults(motion: Motion) -> Iterator[Fault]:
    """Yield a reversed torque of a machine of one joint; none with a person, who may drive it."""
    if motion.machine.mechanism.name != PENDULUM.name or motion.run == "with_human":
        return
    run = observe(motion)
    if run.usable[:, 0].sum() < LEAST_BLOCKS:
        return
    estimates, half = _inertia_and_loss(run, baseline_of([run]))
    if not (estimates + half < 0.0).all():
        return
    (joint,), inertia = motion.machine.joints, motion.machine.mechanism.parameters[0]
    channel = column(motion, 0, "torque")
    (body, loss), (low, lost_low), (high, lost_high) = estimates, estimates - half, estimates + half
    yield Fault(
        FaultKind.SIGN,
        motion.file,
        channel,
        f"the sign of {channel} is reversed, all along: as recorded {the(joint.name)} has an"
        f" inertia of {body:.4g} {inertia.unit} ({low:.4g} … {high:.4g}) and friction that loses"
        f" {loss:.2g} W ({lost_low:.2g} … {lost_high:.2g}). Both must be positive. A reversed"
        f" {column(motion, 0, 'angle')} looks the same; {how_to_correct(motion, 'sign')}",
        proof=by_motion(motion, replace(motion, torque=-motion.torque)),
    )


def _inertia_and_loss(run: Run, model: Baseline) -> tuple[NDArray, NDArray]:
    """Return inertia and friction loss of one joint's fit, and half their intervals, (2,).

    Inertia is in kg·m² or kg, the mean loss in W. A constant torque and a spring are fitted as
    well, and count for neither.
    """
    motion, usable = run.motion, run.usable[:, :1]
    constants = np.stack([np.ones_like(motion.q), motion.q], axis=2)
    columns = (
        np.concatenate(
            [columns_under((), run, model)[0][:, 0], run.average(constants)[:, 0]], axis=1
        )
        * usable
    )
    # Each row maps values to a result: the inertia, and the mean power that friction takes.
    information = np.zeros((2, columns.shape[1]))
    information[0, 0] = 1.0
    friction = model.layout.terms[1].slice
    information[1, friction] = (run.state[1] * columns[:, friction]).sum(axis=0) / usable.sum()
    scale = np.maximum(np.sqrt((columns**2).sum(axis=0)), 1e-12)
    columns, information = columns / scale, information / scale
    torque = run.measured[:, :1] * usable
    # Over a small travel gravity, spring and constant are nearly one column.
    inverse = np.linalg.pinv(columns.T @ columns, rcond=1e-10, hermitian=True)
    values = inverse @ (columns.T @ torque[:, 0])
    scores = (torque - (columns @ values)[:, np.newaxis]) * columns
    segment = motion.segment[run.starts]
    covariance, critical, _ = long_run_covariance(lambda: by_segment(segment, scores), len(values))
    spread = sandwich(information @ inverse, covariance)
    return information @ values, critical * np.sqrt(np.diag(spread))
