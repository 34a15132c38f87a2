"""What a diagnosis says of control: the adaptive loop on the model without and with the named
causes."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.contracts import HIP_AND_KNEE
from pipelines.contracts.fault_kind import FaultKind
from pipelines.diagnosis.data_faults import Fault
from pipelines.diagnosis.data_faults.proof import Proof
from pipelines.diagnosis.verdict.control_benefit import control
from pipelines.dynamics.plant import make_plant
from pipelines.dynamics.tracking import track
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.effects.parallel_spring import ParallelSpring
from pipelines.mechanics.gait import gait
from pipelines.mechanics.geometry import Geometry
from pipelines.model import Model, Term
from pipelines.settings.rig.plant import PlantSettings
from pipelines.settings.simulate import SimulateSettings
from tests.diagnosis.naming import missing, naming
from tests.diagnosis.sessions import diagnosed

SPRING = {"stiffness": 6.0, "rest_angle": -0.5}


@pytest.fixture(scope="module")
def sprung():
    return naming(diagnosed("parallel_spring", "knee", seed=4, **SPRING), "parallel_spring@knee")


def true_loop():
    """The leg that was recorded, under the same controller."""
    leg = PlantSettings()
    friction = zip(("hip", "knee"), leg.coulomb_nm, leg.viscous_nm_s_rad, strict=True)
    spring = ParallelSpring("knee")
    terms = (
        Term(RigidBody(), np.add(leg.exo_inertial, leg.human_inertial)),
        *(
            Term(Friction(joint), np.array([coulomb, viscous]))
            for joint, coulomb, viscous in friction
        ),
        Term(spring, spring.values_from(np.array(list(SPRING.values())))),
    )
    return track(
        make_plant(Model(terms), Geometry(), HIP_AND_KNEE, "with_human"), SimulateSettings(), gait()
    )


@pytest.mark.slow
def test_with_the_cause_named_the_loop_is_that_of_the_true_leg(sprung):
    loop, true = control(sprung), true_loop()
    settled = true.time >= SimulateSettings().settled_after_s
    rms = np.sqrt(np.mean(true.error[settled] ** 2, axis=0))
    peak = np.abs(true.run.torque[settled]).max(axis=0)
    assert (loop["run"], loop["reason"]) == ("with_human", None)
    assert list(loop["with"]["tracking_rmse_rad"].values()) == pytest.approx(rms.tolist(), rel=0.03)
    assert list(loop["with"]["peak_torque_nm"].values()) == pytest.approx(peak.tolist(), rel=0.03)
    off = abs(loop["without"]["peak_torque_nm"]["knee"] - peak[1])
    assert off > 3 * abs(loop["with"]["peak_torque_nm"]["knee"] - peak[1])


def test_a_leg_that_cannot_exist_is_not_simulated_and_the_reason_is_given(sprung):
    heavy = sprung.after.fit.values.copy()
    heavy[[p.name for p in RigidBody.linear].index("X3")] = 9.0
    loop = control(
        replace(sprung, after=replace(sprung.after, fit=replace(sprung.after.fit, values=heavy)))
    )
    assert loop["with"] is None
    assert loop["without"] is not None
    assert loop["reason"].startswith(
        "with the causes: the with_human parameters are not those of a real leg: X2 (X1 - X2) = "
    )
    assert loop["reason"].endswith("the mass matrix is not positive definite")


def test_where_no_cause_is_named_there_is_nothing_to_compare(sprung):
    loop = control(missing(sprung, 0.9))
    assert (loop["with"], loop["reason"]) == (None, "no cause is named")
    assert loop["without"] is not None


def test_no_loop_is_simulated_of_faulty_recordings(sprung):
    proof = Proof(recorded=0.5, mended=0.01, agreement=0.99)
    stuck = Fault(FaultKind.STUCK, "run_0.parquet", "hip_torque_nm", "stuck", proof=proof)
    loop = control(replace(sprung, data=replace(sprung.data, faults=(stuck,))))
    assert loop["without"] is loop["with"] is None
    assert loop["reason"].startswith("acquisition is at fault")
