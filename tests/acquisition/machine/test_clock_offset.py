"""Clocks that drift: measured by late and uneven replies, and corrected in the recording."""

import random
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from pipelines.acquisition.machine.clock_offset import BUCKET_S, Bounds, Drift
from pipelines.acquisition.machine.reading import Reading
from pipelines.acquisition.machine.resampling import Alignment
from pipelines.acquisition.machine.sampling import AIM, SECOND_LOOK
from pipelines.contracts.table import Table
from pipelines.identification.two_step import identify
from pipelines.mechanics.fourier import FourierTrajectory
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.rig.clocks import OwnClock
from pipelines.rig.plant import Plant
from pipelines.settings.filter import FilterSettings
from pipelines.settings.rig.plant import PlantSettings


class Clock:
    """A drive's: sample n is latched at ``origin`` + n periods of its own."""

    def __init__(self, rate_hz, ppm, origin):
        self.period, self.origin = 1 / (rate_hz * (1 + 1e-6 * ppm)), origin

    def newest(self, instant):
        return int((instant - self.origin) // self.period)


def watched(first, other, rate_hz, duration_s, seed=0, latency_s=0.0002, cycle_s=0.005, late=0.05):
    """Ask both drives twice in each cycle, as acquisition does, some replies being very late; yield
    what is found."""
    draw, drift = random.Random(seed), Drift(rate_hz)
    low, high = (share / rate_hz for share in SECOND_LOOK)

    def way():
        return latency_s * draw.lognormvariate(0, 0.3) + (
            draw.expovariate(20.0) if draw.random() < late else 0.0
        )

    bounds = [Bounds(1 / rate_hz) for _ in range(2)]
    now, ends = 1000.0, 1000.0 + BUCKET_S
    while now < 1000.0 + duration_s:
        for clock, its in zip((first, other), bounds, strict=True):
            aim = (its.until_next_sample(now) or 0.0) + draw.gauss(0.0, AIM) / rate_hz
            for sent in (now + draw.uniform(0, 0.2) * cycle_s, now + min(max(aim, low), high)):
                there = sent + way()
                its.add(clock.newest(there), sent, there + way())
        now += cycle_s
        if now >= ends:
            ends = now + BUCKET_S
            drift.add(first.newest(now), bounds[0].close(), bounds[1].close())
        yield now, drift.estimate


def drift_of(*arguments):
    """Return what is found in the end."""
    for _, result in watched(*arguments):
        last = result
    return last


@pytest.mark.parametrize("ppm", [-80.0, 0.0, 40.0])
@pytest.mark.parametrize("rate_hz", [200.0, 1000.0])
def test_offset_and_rate_are_found_within_a_tenth_of_a_sample_and_five_ppm(rate_hz, ppm):
    first, other = Clock(rate_hz, 15.0, 990.0), Clock(rate_hz, 15.0 + ppm, 985.6789)
    result = drift_of(first, other, rate_hz, 120.0)
    true_lead = (first.origin + result.at * first.period - other.origin) / other.period - result.at
    assert result.rate * 1e6 == pytest.approx(ppm, abs=5.0)
    assert (result.lead - true_lead) / rate_hz == pytest.approx(0.0, abs=max(1e-4, 0.1 / rate_hz))


def test_the_stated_errors_cover_the_truth():
    off = []
    for seed in range(10):
        first, other = Clock(1000.0, 0.0, 990.0), Clock(1000.0, 40.0, 985.0 + 0.01234 * seed)
        result = drift_of(first, other, 1000.0, 20.0, seed)
        off.append((result.rate - 40e-6) / result.rate_error)
    assert np.abs(off).max() < 3.0


def reading(sequence, time, angle):
    return Reading(sequence, time, angle, 10 * angle, angle, np.nan, 20.0, angle)


def motion(instants):
    return np.sin(2 * np.pi * instants)


def aligned(position, knee, rows=200, batch=1):
    """Feed a drive that samples at integers and another with its own samples; return the rows that
    come."""
    alignment, result = Alignment([position]), []
    hip = [reading(n, n / 200, motion(n / 200)) for n in range(rows)]
    for start in range(0, rows, batch):
        result += alignment.rows([hip[start : start + batch], knee[start : start + batch]])
    return result


@pytest.mark.parametrize("batch", [1, 7])
def test_a_drives_samples_are_brought_to_the_first_ones_instants(batch):
    # The knee's sample m is taken at (m + 0.3) / 200 (1 + 1e-3): it is in its sample 0.999 n - 0.3
    # at the hip's n.
    def at(m):
        return (m + 0.3) / 200 * (1 + 1e-3)

    knee = [reading(m, 7 + at(m), motion(at(m))) for m in range(200)]
    result = aligned(lambda n: n / (1 + 1e-3) - 0.3, knee, batch=batch)
    sequence = np.array([row[0].sequence for row in result])
    assert np.diff(sequence).tolist() == [1] * (len(sequence) - 1)
    assert len(result) > 190
    assert_allclose([row[1].angle for row in result[1:]], motion(sequence[1:] / 200), atol=2e-7)
    assert_allclose([row[1].time for row in result], 7 + sequence / 200, atol=1e-9)


def test_where_positions_are_whole_samples_they_are_handed_on_untouched():
    knee = [reading(m, m / 200, motion(m / 200)) for m in range(205)]
    result = aligned(lambda n: n + 3.0, knee)
    assert [row[1] for row in result] == knee[3:200]


def test_nothing_is_invented_where_a_sample_is_missing():
    knee = [reading(m, m / 200, motion(m / 200)) for m in range(200) if not 50 <= m < 60]
    result = [row[0].sequence for row in aligned(lambda n: n + 0.5, knee)]
    assert set(range(196)) - set(result) == set(range(49, 60))


def test_rows_wait_until_the_drift_is_known():
    known = []
    alignment = Alignment([lambda n: float(n) if known else None])
    samples = [reading(n, n / 200, 0.0) for n in range(10)]
    assert alignment.rows([samples[:5], samples[:5]]) == []
    known.append(True)
    assert len(alignment.rows([samples[5:], samples[5:]])) == 10


RICH = FourierTrajectory(
    omega=0.4 * np.pi,
    theta0=np.array([0.65, -0.93]),
    a=np.array([[0.22, -0.16, 0.10], [0.12, 0.24, -0.11]]),
    b=np.array([[0.10, 0.12, -0.07], [-0.22, 0.08, 0.10]]),
)
RATE, LEAD_S, RUN_S = 200.0, 5.0, 20.0


@pytest.fixture(scope="module")
def moved():
    """The plant's samples along a motion, at 1 kHz."""
    plant = Plant(PlantSettings(), "exo_alone", seed=1, sample_rate_hz=1000.0)
    instants = (np.arange(round((LEAD_S + RUN_S) * 1000)) + 0.5) / 1000
    share = np.minimum(instants / 3.0, 1.0)[:, np.newaxis] ** 2
    return plant.run(
        plant.reference + share * (RICH.at(instants)[0] - plant.reference), np.ones(2, bool)
    )


def readings_of(moved, joint, ppm, offset_s):
    """Return the readings of a drive with a clock of its own."""
    samples = OwnClock(ppm, offset_s, RATE, 1000.0).sampled(moved)
    return [
        Reading(
            int(n),
            float(t),
            float(q[joint]),
            float(tau[joint]),
            0.0,
            float(v[joint]),
            20.0,
            float(r[joint]),
        )
        for n, t, q, tau, v, r in zip(
            samples.sequence,
            samples.time,
            samples.angle,
            samples.torque,
            samples.velocity,
            samples.reference,
            strict=True,
        )
    ]


def recorded(moved, ppm, offset_s):
    """Return a recording of a hip and a knee whose clock drifts against the hip's, brought to the
    hip's instants."""
    hip, knee = readings_of(moved, 0, 0.0, 0.0), readings_of(moved, 1, ppm, offset_s)
    began = knee[0].sequence
    # Sample n of a drive's n is taken half a period after the n-th began; the host's clock starts
    # at 1000 s.
    clocks = [Clock(RATE, of, 1000.0 + 0.5 / RATE / (1 + 1e-6 * of)) for of in (0.0, ppm)]
    clocks[1].origin -= began * clocks[1].period
    result, rows = [None], []
    alignment = Alignment([lambda n: result[0].position(n) if result[0] else None])
    at = [0, 0]
    for now, estimate in watched(*clocks, RATE, LEAD_S + RUN_S - 0.1):
        result[0], samples = estimate, []
        for k, (clock, readings) in enumerate(zip(clocks, (hip, knee), strict=True)):
            until = max(clock.newest(now) - readings[0].sequence + 1, at[k])
            samples.append(readings[at[k] : until])
            at[k] = until
        rows += [row for row in alignment.rows(samples) if row[0].time > LEAD_S]
    columns = {"time_s": [row[0].time - rows[0][0].time for row in rows]}
    for j, joint in enumerate(("hip", "knee")):
        for name, unit in (("angle", "rad"), ("torque", "nm")):
            columns[f"{joint}_{name}_{unit}"] = [getattr(row[j], name) for row in rows]
    metadata = {"run": "exo_alone", "sample_rate_hz": RATE, "period_s": RICH.period_s}
    return pd.DataFrame(columns), metadata


def identified(frame, metadata):
    motions = []
    for purpose in ("train", "validate"):
        table = Table(frame, {**metadata, "purpose": purpose}, Path(purpose))
        motions.append(motion_from_table(motion_table(table, FilterSettings())))
    return identify(motions).parameters


def test_drives_whose_clocks_drift_identify_the_parameters_of_those_whose_clocks_do_not(moved):
    drifting, (common, metadata) = recorded(moved, 40.0, 12.3456), recorded(moved, 0.0, 0.0)
    assert len(drifting[0]) > 0.99 * RUN_S * RATE
    with_drift, without = identified(*drifting), identified(common, metadata)
    off = (with_drift["value"] - without["value"]) / without["std_error"]
    assert np.abs(off).max() < 0.5


def test_uncorrected_the_same_drift_would_spoil_them(moved):
    """By the counters alone the knee is 0.16 samples off after 20 s, plus any offset."""
    common, metadata = recorded(moved, 0.0, 0.0)
    late = common.copy()
    for column in ("knee_angle_rad", "knee_torque_nm"):
        late[column] = late[column].shift(2, fill_value=late[column][0])
    off = identified(late, metadata)["value"] - identified(common, metadata)["value"]
    assert np.abs(off / identified(common, metadata)["std_error"]).max() > 0.5
