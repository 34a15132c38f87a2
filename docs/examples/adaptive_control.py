"""Let the paper's leg follow a gait under adaptive control, for several feedback gains."""

import numpy as np

from pipelines.contracts import HIP_AND_KNEE
from pipelines.dynamics.plant import make_plant
from pipelines.dynamics.tracking import track
from pipelines.effects.baseline import Friction, RigidBody
from pipelines.mechanics.gait import gait
from pipelines.mechanics.geometry import Geometry
from pipelines.model import Model, Term
from pipelines.settings.simulate import SimulateSettings

# The paper's Table 3: X1..X4, then Coulomb and viscous friction of hip and knee.
TABLE_3 = Model(
    (
        Term(RigidBody(), np.array([10.3016, 3.0157, 2.2664, 5.5354])),
        Term(Friction("hip"), np.array([2.6596, 4.14895])),
        Term(Friction("knee"), np.array([4.7197, 7.3602])),
    )
)

leg = make_plant(TABLE_3, Geometry(), HIP_AND_KNEE, "with_human")
errors = {}
for gain in (50.0, 100.0, 200.0, 300.0, 500.0):
    loop = track(leg, SimulateSettings(), gait(), feedback_gain=gain)
    errors[gain] = loop.worst_error(5.0)
    hip, knee = errors[gain]
    print(
        f"Kv {gain:3.0f} N·m·s/rad: largest error after 5 s {hip:.4f} rad at the hip, {knee:.4f}"
        " rad at the knee"
    )

assert np.all(np.diff(np.array(list(errors.values())), axis=0) < 0), "the error falls with the gain"
