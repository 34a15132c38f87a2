"""``make estimators``: bias, coverage and time of every method, as docs/estimators.md shows them.

python -m tests.campaigns.estimators --sessions 40 --legs 4
"""

import argparse
import os

# Before NumPy is loaded: times are those of one core.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from pipelines.estimation.estimators import ESTIMATORS, estimator_named
from tests.campaigns.estimators import leg, pendulum, real

parser = argparse.ArgumentParser(prog="python -m tests.campaigns.estimators", description=__doc__)
parser.add_argument(
    "--sessions", type=int, default=40, help="simulated sessions of the pendulum, of each kind"
)
parser.add_argument("--legs", type=int, default=4, help="simulated sessions of MuJoCo's leg")
parser.add_argument(
    "--parts", nargs="+", default=["pendulum", "leg", "real"], choices=["pendulum", "leg", "real"]
)
names = [estimator.name for estimator in ESTIMATORS]
parser.add_argument("--methods", nargs="+", default=names, choices=names)
chosen = parser.parse_args()
methods = [estimator_named(name) for name in chosen.methods]
if "pendulum" in chosen.parts:
    pendulum.show(methods, chosen.sessions)
if "leg" in chosen.parts:
    leg.show(methods, chosen.legs)
if "real" in chosen.parts:
    real.show(methods)
