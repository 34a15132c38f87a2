"""Figures of the residual that each effect causes, for a virtual leg that has it.

`python docs/site/signatures.py FOLDER [EFFECT ...]` draws them; `make docs` does so for the
effects' pages.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from numpy.typing import NDArray

from pipelines.contracts.table import Table
from pipelines.effects import EFFECTS, RUNS, Effect
from pipelines.estimation.regression import Regression, regressions, residual_of
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.machine import THE_LEG
from pipelines.mechanics.motion import Motion, motion_from_table
from pipelines.model import Model, Term, baseline
from pipelines.plotting.style import BLUE, GREY, ORANGE, STYLE, save
from pipelines.rig.plant import Plant
from pipelines.rig.record import record
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings, TemperatureSettings
from tests.effects.catalogue import places, sized

EXCITATION = FourierTrajectory(
    theta0=np.array([0.65, -0.93]),
    a=np.array([[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]),
    b=np.array([[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]),
    omega=0.2 * np.pi,
)
"""Both joints move both ways through most of their range."""
SECONDS = 20.0
QUIET = PlantSettings(
    ripple_nm=(0.1, 0.1), temperature=TemperatureSettings(heating_c_nm2=0.05, time_constant_s=10.0)
)
"""Less noise than a rig has, and drives that warm at once: the figure is of the effect."""
LARGE = {
    "backlash": (0.05,),
    "cuff_compliance": (60.0,),
    "encoder_eccentricity": (0.09, 0.06, 0.0, 0.0),
    "joint_elasticity": (150.0,),
    "rotor_inertia": (0.6,),
    "time_delay": (0.05,),
}
"""Sizes other than the catalogue's, of effects that the baseline hides if they are small."""
LONGEST_TITLE = 48
"""Characters of sizes that leave room for the legend."""
LEAST_NM = 0.5
"""Least half of a figure's height, so that mere noise does not fill it."""


@dataclass(frozen=True)
class Signature:
    """The residual of a model without an effect, for a leg that has it."""

    term: Term | None
    """The effect as the leg has it; None for the baseline's own."""
    regression: Regression
    """Of the run with the wearer."""
    residual: NDArray
    """(m, J) N·m."""

    @property
    def joint(self) -> int:
        """The joint with the largest residual."""
        return int(
            np.argmax(
                [np.std(self.residual[rows, j]) for j, rows in enumerate(self.regression.usable.T)]
            )
        )

    @property
    def sizes(self) -> str:
        """The effect's place and parameters, with units."""
        if self.term is None:
            return "residual of a model without it"
        effect = self.term.effect
        values = zip(effect.parameters, effect.physical(self.term.values), strict=True)
        sizes = [
            f"{p.name} {v:.3g}{'' if p.unit == '1' else ' ' + p.unit}"
            for p, v in values
            if v != p.default
        ]
        while len(sizes) > 1 and len(", ".join(sizes)) > LONGEST_TITLE:
            sizes.pop()
        place = f"at the {effect.joint}, " if effect.joint else ""
        return (place + ", ".join(sizes)).replace("_", " ")


def signature(effect: type[Effect]) -> Signature:
    """Fit rigid body and friction to two runs of a leg that has the effect.

    One run is without a wearer, one with. For rigid body and friction themselves, the model lacks
    that one.
    """
    bodies_and_friction = baseline(THE_LEG, RUNS)
    hidden = None if effect in map(type, bodies_and_friction) else _sized(effect)
    assumed = Model.of(e for e in bodies_and_friction if e.name != effect.name)
    fits = [next(regressions(motion, assumed)) for motion in _recorded([hidden] if hidden else [])]
    A, y = (
        np.concatenate([part[r.usable] for r, part in zip(fits, parts, strict=True)])
        for parts in ([r.regressor for r in fits], [r.torque for r in fits])
    )
    values = np.linalg.lstsq(A, y, rcond=None)[0]
    return Signature(hidden, fits[-1], residual_of(fits[-1], values))


def _sized(effect: type[Effect]) -> Term:
    """Return the effect at the last joint that can have it."""
    joint = places(effect)[-1]
    bound = effect(joint=joint)
    return (
        Term(bound, np.array(LARGE[effect.name])) if effect.name in LARGE else sized(effect, joint)
    )


def _recorded(hidden: list[Term]) -> list[Motion]:
    """Return one run of each kind of a leg with these effects."""
    plants = (Plant(QUIET, run, seed=seed, effects=hidden) for seed, run in enumerate(RUNS))
    tables = (Table(*record(plant, EXCITATION, SECONDS)) for plant in plants)
    return [motion_from_table(motion_table(table, FilterSettings())) for table in tables]


def draw(effect: type[Effect], stem: Path) -> None:
    """Write the residual of an effect against time, angle and velocity as ``stem``.png."""
    shown = signature(effect)
    r, joint = shown.regression, shown.joint
    name = THE_LEG.names[joint]
    residual = shown.residual[:, joint]
    half = max(LEAST_NM, 1.15 * np.abs(residual[r.usable[:, joint]]).max())
    against = {
        "time, s": r.time,
        f"{name} angle, rad": r.state[0],
        f"{name} velocity, rad/s": r.state[1],
    }
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 3, figsize=(8.4, 2.4), sharey=True, width_ratios=[4, 3, 3])
        for axis, (label, x) in zip(axes, against.items(), strict=True):
            _scatter(axis, x if x.ndim == 1 else x[:, joint], residual, r, joint)
            axis.set(xlabel=label, ylim=(-half, half))
        axes[0].set_ylabel(f"residual at the {name}, N·m")
        figure.suptitle(f"{effect.title}: {shown.sizes}", x=0.01, ha="left", fontsize=9)
        figure.legend(
            *axes[0].get_legend_handles_labels(),
            loc="upper right",
            ncols=3,
            markerscale=4,
            fontsize=8,
        )
        figure.tight_layout(rect=(0.0, 0.0, 1.0, 0.96))
        save(figure, stem, kinds=["png"])


def _scatter(axis: Axes, x: NDArray, residual: NDArray, r: Regression, joint: int) -> None:
    usable, forward = r.usable[:, joint], r.state[1][:, joint] > 0
    shown = [
        (~usable & r.valid, GREY, "near a reversal"),
        (usable & forward, BLUE, "forward"),
        (usable & ~forward, ORANGE, "back"),
    ]
    for rows, colour, label in shown:
        axis.plot(x[rows], residual[rows], ".", ms=1.6, color=colour, label=label)
    axis.axhline(0.0, color="black", lw=0.6)


def ours() -> list[type[Effect]]:
    """Return the effects that have a page in docs/effects."""
    return [effect for effect in EFFECTS if effect.__module__.startswith("pipelines.effects.")]


if __name__ == "__main__":
    folder, *names = sys.argv[1:]
    Path(folder).mkdir(parents=True, exist_ok=True)
    for effect in ours():
        if not names or effect.name in names:
            draw(effect, Path(folder) / effect.name)
