"""When something begins in a run: found wherever it is, and its interval holds it as often as it
says.

The arms are none of exoid's equations: a path that is known, and what torque takes it there.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from pipelines.diagnosis.candidates.candidate import ALWAYS, NEVER, Candidate
from pipelines.diagnosis.diagnose import diagnose
from pipelines.diagnosis.evidence.baseline import baseline_of
from pipelines.diagnosis.evidence.observed_run import observe
from pipelines.diagnosis.fit.change_point import Onset
from pipelines.diagnosis.fit.held_out import terms_with_own_values
from pipelines.diagnosis.fit.joint_refinement import Refinement
from pipelines.diagnosis.fit.uncertainty import uncertainty
from pipelines.diagnosis.verdict.verdict import verdict
from pipelines.effects import PayloadChange
from pipelines.mechanics.kinematics import motion_table
from pipelines.mechanics.motion import motion_from_table
from pipelines.mechanics.scale import on_one_scale
from pipelines.settings.filter import FilterSettings
from tests.diagnosis.machines import driven

SECONDS = 40.0
HANDED = 0.27
"""kg."""


def handed(purpose, seed, instant, mass=HANDED, kind="revolute"):
    """Return an arm or a lift to which a mass (kg) is handed at an instant, 0.3 m from the axis
    where there is one."""

    def more(t, q, dq, ddq, own):
        arm = 0.3 * mass * (0.3 * ddq + 9.81 * np.sin(q))
        return (t >= instant) * (arm if kind == "revolute" else mass * (0.1 * ddq + 9.81) / 20.0)

    run = driven(purpose, seed, kind, more, SECONDS)
    return replace(
        motion_from_table(motion_table(run, FilterSettings())), file=f"{purpose}_{seed}.parquet"
    )


def observed(*motions):
    return [observe(m) for m in on_one_scale(motions)]


def fitted(runs, begun):
    """Return the fit of a load that is handed over, sought from the instants that it may have been
    ``begun`` at."""
    baseline = baseline_of(runs)
    cause = Candidate(
        PayloadChange(joint="arm", on=baseline.machine), tuple((t, 0.3) for t in begun)
    )
    return Refinement(runs, baseline, np.array([1.0, 0.0]))([cause]), baseline


def onset_of(run, noise, pull, instant):
    """Return the onset of what pulls so much, (m,) N·m, from an instant on, in noise (m, O) of
    known size."""
    torque = np.zeros_like(noise)
    torque[:, 0] = pull
    gate = (run.time >= instant)[:, np.newaxis]
    weights = np.array([1.0, 0.0]) / np.mean(noise[:, 0] ** 2)
    return Onset.of(run, noise + gate * torque, noise - ~gate * torque, run.usable, weights)


@pytest.fixture(scope="module")
def run():
    return observed(handed("train", 1, 20.0))[0]


def test_intervals_hold_the_instant_as_often_as_they_say_in_noise_that_lasts(run):
    draw = np.random.default_rng(0)
    pull = 0.6 * np.sin(run.state[0][:, 0]) + 0.1
    held, widths = [], []
    for _ in range(400):
        noise = np.zeros_like(run.measured)
        noise[:, 0] = lfilter([0.2], [1.0, -0.7], draw.normal(size=len(run.time)))
        instant = draw.uniform(8.0, 32.0)
        onset = onset_of(run, noise, pull, instant)
        low, high = onset.interval(run, np.zeros(2))
        held.append(low <= instant <= high)
        widths.append(high - low)
    # Of 400 that hold it 95 % of the time fewer than 368 would by chance in one of two hundred; and
    # they must tell.
    assert np.mean(held) >= 0.92
    assert np.median(widths) < 2.0


def test_what_never_came_and_what_was_always_there_needs_no_coincidence(run):
    draw = np.random.default_rng(1)
    pull = 0.4 * np.sin(run.state[0][:, 0])
    instants = []
    for instant in (NEVER, ALWAYS) * 100:
        noise = np.zeros_like(run.measured)
        noise[:, 0] = lfilter([0.2], [1.0, -0.7], draw.normal(size=len(run.time)))
        onset = onset_of(run, noise, pull, instant)
        low, high = onset.interval(run, np.zeros(2))
        instants.append(onset.likeliest == instant)
        assert (
            not instants[-1]
            or (high if instant == NEVER else low) == onset.instants[-2 if instant == NEVER else 1]
        )
    assert np.mean(instants) >= 0.92


@pytest.mark.parametrize("begun", [3.0, 20.0, 37.0, NEVER])
def test_an_instant_is_found_from_wherever_the_search_begins(begun):
    """With a run in which it is known, so that the amplitude is."""
    runs = observed(handed("train", 5, 17.3), handed("train", 6, 29.1))
    result, baseline = fitted(runs, (17.3, begun))
    assert [shape[0] for shape in result.causes[0].shapes] == pytest.approx([17.3, 29.1], abs=0.4)
    (term,) = terms_with_own_values(result, runs[1], baseline)
    assert term.shape[0] == pytest.approx(29.1, abs=0.4)


def test_a_run_to_which_nothing_was_handed_has_no_value():
    runs = observed(handed("train", 5, 17.3), handed("train", 6, SECONDS + 1.0))
    result, baseline = fitted(runs, (17.3, 12.0))
    assert result.causes[0].shapes[1][0] == NEVER
    low, high = uncertainty(result, runs, baseline, np.array([0.05, 0.0])).onsets[0, 0, 1]
    assert low <= high == pytest.approx(SECONDS, abs=0.1)


@pytest.mark.parametrize(
    ("kind", "of_all"),
    [("revolute", 0.3 * HANDED), pytest.param("prismatic", 2.0, marks=pytest.mark.slow)],
)
def test_a_load_that_is_handed_over_is_named_with_its_size_and_when_in_every_run(kind, of_all):
    """At an arm by its moment in kg·m, at a lift by its mass."""
    hidden = {"train_1.parquet": 11.7, "train_2.parquet": 26.2, "validate_3.parquet": 30.4}
    motions = [
        handed(file.split("_")[0], seed, at, HANDED if kind == "revolute" else 2.0, kind)
        for seed, (file, at) in enumerate(hidden.items(), start=1)
    ]
    (cause,) = verdict(diagnose(motions))["causes"]
    assert cause["effect"] == "payload_change"
    amount = cause["parameters"][0]
    assert amount["ci95"][0] < of_all < amount["ci95"][1] and amount["value"] == pytest.approx(
        of_all, rel=0.1
    )
    assert amount["unit"] == ("kg·m" if kind == "revolute" else "kg")
    values = {one["file"]: one for one in cause["each_run"]}
    assert {file: one["values"]["time"] for file, one in values.items()} == pytest.approx(
        hidden, abs=0.5
    )
    for file in ("train_1.parquet", "train_2.parquet"):
        low, high = values[file]["ci95"]["time"]
        assert low <= hidden[file] <= high and high - low < 2.0
    of_first = next(p for p in cause["parameters"] if p["name"] == "time")
    assert of_first["ci95"] == values["train_1.parquet"]["ci95"]["time"]


@pytest.mark.slow
def test_intervals_of_a_diagnosis_hold_amplitude_and_instants_as_often_as_they_say():
    draw = np.random.default_rng(7)
    instants, amplitudes = [], []
    for seed in range(100, 160, 2):
        begun = draw.uniform(6.0, 34.0, 3)
        mass = draw.uniform(0.1, 0.4)
        motions = [
            handed(purpose, seed * 10 + k, at, mass)
            for k, (purpose, at) in enumerate(
                zip(("train", "train", "validate"), begun, strict=True)
            )
        ]
        for cause in verdict(diagnose(motions))["causes"]:
            if cause["effect"] == "payload_change":
                low, high = cause["parameters"][0]["ci95"]
                amplitudes.append(low <= 0.3 * mass <= high)
                for one, at in zip(cause["each_run"], begun[:2], strict=False):
                    low, high = one["ci95"]["time"] or (np.inf, np.inf)
                    instants.append(low <= at <= high)
    # Shares that 95 % would fall below by chance in one of a hundred campaigns.
    assert len(amplitudes) >= 25 and np.mean(amplitudes) >= 0.82
    assert np.mean(instants) >= 0.87
