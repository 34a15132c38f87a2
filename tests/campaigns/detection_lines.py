"""Error rates and power of the tests at detection lines (docs/diagnosis.md).

The first table has the share of simulations of noise alone whose p-value is below 0.05 and 0.01,
the second the p-values at the knee of a virtual leg, where a cause is hidden or not.
"""

import sys

import numpy as np

from pipelines.diagnosis.evidence.detection_lines import p_values, residual_lines
from pipelines.diagnosis.evidence.observed_run import observe
from tests.diagnosis.test_detection_lines import knee, noise, session

CASES = ((1, 0.0), (1, 0.2), (4, 0.02), (4, 20.0))
"""Runs, and correlation time of the noise, s."""
HIDDEN = (
    (None, {}),
    ("viscous_asymmetry", {"asymmetry": 1.2}),
    ("backlash", {"play": 0.03, "contact_stiffness": 20000.0}),
    ("quadratic_drag", {"drag": 1.8}),
    ("stribeck_friction", {"stribeck_torque": 3.0, "stribeck_velocity": 0.1}),
    ("coulomb_asymmetry", {"asymmetry": 2.0}),
    ("rotor_inertia", {"inertia": 0.3}),
)


def main(trials: int) -> None:
    """Print both tables."""
    print("| noise alone | excited | odd | even |\n|---|---|---|---|")
    for count, correlation_s in CASES:
        rng = np.random.default_rng(11)
        runs = [observe(motion) for motion in session()[:count]]
        p = []
        for _ in range(trials):
            drawn = [noise(rng, len(run.time), correlation_s) for run in runs]
            one = p_values(residual_lines(runs, drawn, 0)[1])
            p.append([one.excited, one.odd, one.even])
        shares = [np.mean(np.array(p) < level, axis=0) for level in (0.05, 0.01)]
        cells = " | ".join(f"{five:.1%}, {one:.1%}" for five, one in zip(*shares, strict=True))
        print(f"| runs: {count}, correlated over {correlation_s:g} s | {cells} |", flush=True)
    print("\n| hidden at the knee | excited | odd | even |\n|---|---|---|---|")
    for effect, values in HIDDEN:
        p_value = knee(effect, **values).p_value
        cells = " | ".join(f"{p:.2g}" for p in (p_value.excited, p_value.odd, p_value.even))
        print(f"| {effect or 'nothing'} {values or ''} | {cells} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 800)
