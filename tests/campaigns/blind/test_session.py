"""A session is what its seed says, hits its magnitude, reads as a recording, and keeps its
secret."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.testing import assert_array_equal

from pipelines.contracts import RECORDING
from pipelines.identification import identify
from pipelines.identification.validation import residuals
from pipelines.mechanics.read import read_motions
from tests.campaigns.blind.cases import CAUSES, Case
from tests.campaigns.blind.causes import FORMS
from tests.campaigns.blind.faults import FAULTS, WORDS
from tests.campaigns.blind.floor import noise_floor
from tests.campaigns.blind.magnitude import magnitude
from tests.campaigns.blind.outside import OUTSIDE
from tests.campaigns.blind.plan import HIP, KNEE
from tests.campaigns.blind.session import simulate, write

SEED = 900_100


def single(effect, joint, seed=SEED):
    return Case(seed, "single", ((effect, joint),), plain=True)


@pytest.fixture(scope="module")
def faultless(tmp_path_factory):
    folder = tmp_path_factory.mktemp("faultless")
    session = simulate(Case(SEED, "none", plain=True))
    write(session, folder / "recordings", folder / "truth.json")
    return session, sorted((folder / "recordings").iterdir())


def test_exoid_fits_a_faultless_session_to_its_noise(faultless):
    session, paths = faultless
    runs = read_motions(paths)
    identified = identify(runs)
    residual = pa.concat_tables(residuals(runs, identified.model_of, "baseline")).to_pandas()
    scored = residual[residual["scored"] & (residual["purpose"] == "validate")]
    floor = noise_floor(session.rig, session.of("validate"))
    for joint, noise in zip(("hip", "knee"), floor, strict=True):
        assert np.sqrt(np.mean(scored[f"{joint}_residual_nm"] ** 2)) == pytest.approx(
            noise, rel=0.05
        )


def test_exoid_finds_the_friction_and_inertia_of_a_faultless_session(faultless):
    session, paths = faultless
    table = identify(read_motions(paths)).parameters.set_index(["run", "name"])["value"]
    # MuJoCo's leg and exoid's: two implementations of one machine. The hip's rotor is part of X1.
    expected = session.rig.leg(session.runs[-1].run).inertial()
    expected[0] += session.rig.machine.hip_rotor
    assert [table["with_human", f"X{i}"] for i in (1, 2, 3, 4)] == pytest.approx(expected, rel=0.06)


def test_recordings_keep_the_contract(faultless):
    session, paths = faultless
    tables = [RECORDING.read(path) for path in paths]
    assert sorted(t.metadata["run"] for t in tables) == [
        "exo_alone",
        "exo_alone",
        "with_human",
        "with_human",
    ]
    assert sorted(t.metadata["purpose"] for t in tables) == [
        "train",
        "train",
        "validate",
        "validate",
    ]
    assert all(len(t.frame) == len(session.runs[0].time) for t in tables)


@pytest.mark.parametrize(
    ("effect", "joint"),
    [
        ("stribeck_friction", KNEE),
        ("encoder_offset", HIP),
        pytest.param("backlash", KNEE, marks=pytest.mark.slow),
        pytest.param("torque_drift", KNEE, marks=pytest.mark.slow),
        ("voluntary_torque", HIP),
    ],
)
def test_magnitude_is_what_was_wanted(effect, joint):
    session = simulate(single(effect, joint))
    ((cause, _, wanted),) = session.hidden
    assert magnitude(cause, session.runs) == pytest.approx(wanted, rel=0.2)


def test_equal_seeds_give_equal_sessions_and_others_others():
    first, again, other = (
        simulate(Case(seed, "fault", fault="gap", plain=True)) for seed in (SEED, SEED, SEED + 1)
    )
    for a, b in zip(first.runs, again.runs, strict=True):
        assert_array_equal(a.torque, b.torque)
        assert_array_equal(a.angle, b.angle)
    assert not np.allclose(first.runs[0].torque[:1000], other.runs[0].torque[:1000])


def test_human_causes_leave_the_empty_machine_alone():
    hidden, none = simulate(single("spasticity", KNEE)), simulate(Case(SEED, "none", plain=True))
    for a, b in zip(hidden.runs, none.runs, strict=True):
        assert np.array_equal(a.torque, b.torque) == (a.run.kind == "exo_alone")


def test_recordings_say_nothing_of_the_truth(tmp_path):
    session = simulate(single("backlash", KNEE))
    write(session, tmp_path / "recordings", tmp_path / "truth.json")
    truth = json.loads((tmp_path / "truth.json").read_text())
    secrets = {
        *CAUSES,
        *(f.form for forms in FORMS.values() for f in forms),
        "seed",
        str(SEED),
        "hidden",
    }
    assert truth["hidden"][0]["effect"] in secrets
    for path in (tmp_path / "recordings").iterdir():
        assert path.name in {f"run_{i}.parquet" for i in (1, 2, 3, 4)}
        schema = pq.read_schema(path)
        text = " ".join([*schema.names, *(v.decode() for v in schema.metadata.values())])
        assert not [secret for secret in secrets if secret in text]
        header = json.loads(schema.metadata[b"exoid"])
        assert set(header) == {
            "contract",
            "run",
            "purpose",
            "sample_rate_hz",
            "period_s",
            "session",
            "controller",
            "geometry",
        }


def test_every_cause_of_the_contract_can_be_hidden(pytestconfig):
    page = (pytestconfig.rootpath / "docs" / "contracts.md").read_text()
    table = page.split("## The causes' names")[1].split("\n## ")[0]
    named = {line.split("`")[1] for line in table.splitlines() if line.startswith("| `")}
    # No motion separates a rotor's coupling from the shank's and the rotor's inertia: nothing could
    # name it.
    lacking = named - {"rotor_coupling"} - set(CAUSES)
    assert not lacking, "give these a form in further_forms.py and units in units.py"


def test_causes_have_forms_other_than_the_catalogues():
    assert all(any(not f.own for f in forms) for forms in FORMS.values())


@pytest.mark.slow
@pytest.mark.parametrize("kind", OUTSIDE, ids=str)
def test_what_is_outside_the_catalogue_has_the_magnitude_that_was_wanted(kind):
    session = simulate(Case(SEED, "outside", ((f"outside:{kind}", KNEE),)))
    ((cause, size, wanted),) = session.hidden
    assert (
        magnitude(cause, session.runs) == pytest.approx(wanted, rel=0.25) or size == cause.largest
    )


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_a_fault_changes_the_files_that_the_truth_names(fault, faultless, tmp_path):
    session, sound = faultless
    faulty = type(session)(
        Case(SEED, "fault", fault=fault.__name__, plain=True), session.rig, [], session.runs
    )
    write(faulty, tmp_path / "recordings", tmp_path / "truth.json")
    truth = json.loads((tmp_path / "truth.json").read_text())["fault"]
    changed = {
        p.name for p in sound if p.read_bytes() != (tmp_path / "recordings" / p.name).read_bytes()
    }
    assert changed == set(truth["files"])
    assert truth["fault"] in WORDS
