"""Simulated legs: the plant of the blind examination, with a spring of known stiffness at the knee
or without."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.contracts import RECORDING
from pipelines.contracts.table import Table
from tests.campaigns.blind.cases import Case
from tests.campaigns.blind.excitation import random_excitation
from tests.campaigns.blind.machine import random_machine
from tests.campaigns.blind.people import random_person
from tests.campaigns.blind.plan import KNEE, Plan, Run
from tests.campaigns.blind.plant import Rig, record
from tests.campaigns.blind.session import Session, write
from tests.campaigns.blind.smooth import SPRING
from tests.campaigns.peers.answer import Log

STIFFNESS, REST = 8.0, -0.9
"""N·m/rad, rad: what is hidden at the knee."""
DURATION_S = 40.0
FIRST_SEED = 900_500
"""Of the fixed range: no tuning has seen these legs."""


@dataclass(frozen=True)
class Leg:
    """A simulated leg's recordings and its truth."""

    files: list[Path]
    train: Log
    validate: Log
    truth: NDArray
    """(8,) in the order of ``NAMES``."""
    masses: NDArray
    """Of thigh and shank, kg."""
    thigh_inertia: float
    """About its centre, kg·m²."""


def simulated(number: int, spring: bool, folder: Path) -> Leg:
    """Record an empty leg of random make twice, once to train and once to validate on."""
    seed = FIRST_SEED + number

    def draw(*part: int) -> np.random.Generator:
        return np.random.default_rng([seed, *part])

    person = random_person(draw(0))
    rig = Rig(random_machine(draw(1), person.thigh_length), person)
    runs = []
    for k, purpose in enumerate(("train", "validate")):
        plan = Plan()
        if spring:
            plan.torque(SPRING, KNEE, STIFFNESS, REST, 0.0, 0.0)
        run = Run("exo_alone", purpose, DURATION_S, draw(2, k))
        runs.append(record(rig, random_excitation(draw(3, k)), plan, run, draw(4, k)))
    session = Session(Case(seed, "none", kinds=("exo_alone",), plain=True), rig, [], runs)
    write(session, folder / "recordings", folder / "truth.json")
    files = sorted((folder / "recordings").iterdir())
    machine = rig.machine
    truth = np.concatenate([machine.leg.inertial(), machine.coulomb, machine.viscous])
    truth[0] += machine.hip_rotor
    logs = logs_by_purpose(files)
    masses = np.array([machine.leg.thigh.mass, machine.leg.shank.mass])
    return Leg(files, logs["train"], logs["validate"], truth, masses, machine.leg.thigh.inertia)


def logs_by_purpose(files: list[Path]) -> dict[str, Log]:
    """Read recordings as a tool gets them, by what each is for."""
    tables = [RECORDING.read(file) for file in files]
    return {table.metadata["purpose"]: _log(table) for table in tables}


def _log(table: Table) -> Log:
    """Return a run on a uniform grid: a log with irregular instants is laid on its mean rate by
    straight lines."""
    frame, geometry, controller = (
        table.frame,
        table.metadata["geometry"],
        table.metadata.get("controller") or {},
    )
    recorded = frame["time_s"].to_numpy()
    time = np.linspace(recorded[0], recorded[-1], len(recorded))

    def pair(quantity: str) -> NDArray | None:
        names = [f"{joint.name}_{quantity}" for joint in table.joints]
        if not set(names) <= set(frame):
            return None
        return np.column_stack(
            [np.interp(time, recorded, frame[name].to_numpy()) for name in names]
        )

    def gains(name: str) -> NDArray | None:
        return (
            np.array([controller[joint.name][name] for joint in table.joints])
            if controller
            else None
        )

    return Log(
        time=time,
        angle=pair("angle_rad"),
        torque=pair("torque_nm"),
        length=geometry["thigh_length_m"],
        gravity=geometry["gravity_m_s2"],
        reference=pair("reference_rad"),
        velocity=pair("velocity_rad_s"),
        kp=gains("kp_nm_rad"),
        kd=gains("kd_nm_s_rad"),
    )
