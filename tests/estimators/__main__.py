"""``make estimators``: bias, coverage and time of every method, as docs/estimators.md shows them.

python -m tests.estimators --sessions 40 --legs 4
"""

import argparse
import os

# Before NumPy is loaded: times are those of one core.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.estimators import leg, pendulum, real

parser = argparse.ArgumentParser(prog="python -m tests.estimators", description=__doc__)
parser.add_argument("--sessions", type=int, default=40, help="simulated sessions of the pendulum, of each kind")
parser.add_argument("--legs", type=int, default=4, help="simulated sessions of MuJoCo's leg")
parser.add_argument("--parts", nargs="+", default=["pendulum", "leg", "real"], choices=["pendulum", "leg", "real"])
chosen = parser.parse_args()
if "pendulum" in chosen.parts:
    pendulum.show(chosen.sessions)
if "leg" in chosen.parts:
    leg.show(chosen.legs)
if "real" in chosen.parts:
    real.show()
