"""What a run's table says beside its numbers: where the causes make it worse, and why it has none
with them."""

import pandas as pd
import pytest

from pipelines.contracts import PARAMETERS, RESIDUALS, Joint
from pipelines.contracts.provenance import sha256
from pipelines.report.html.report import report
from pipelines.report.sections.fit_quality import scores
from pipelines.report.sections.key_figures import tiles
from pipelines.report.sections.parameters import models
from pipelines.report.sections.validation_runs import refusal
from pipelines.report.session import find
from tests.report.sessions import (
    RUN,
    verdict_of,
    write_parameters,
    write_recording,
    write_replay,
    write_residuals,
    write_session,
    write_verdict,
)

PENDULUM = (Joint("joint"),)


def session_with(folder, effect, **values):
    """Write a pendulum's session whose model with one effect was never simulated, and that without
    it was."""
    recording = write_recording(folder, PENDULUM)
    baseline, extended = (
        write_parameters(folder, PENDULUM, extended=which) for which in (False, True)
    )
    table = PARAMETERS.read(extended)
    kept = table.frame[table.frame["effect"] != "cogging"]
    rows = [
        ("friction", "viscous", 1.0),
        *((effect, name, value) for name, value in values.items()),
    ]
    more = pd.concat([kept.tail(1)] * len(rows), ignore_index=True)
    more[["effect", "name", "value"]] = rows
    about = {key: value for key, value in table.metadata.items() if key != "covariance"}
    PARAMETERS.write(extended, pd.concat([kept, more], ignore_index=True), about)
    write_residuals(folder, PENDULUM)
    cause = verdict_of(PENDULUM)["causes"][0] | {"effect": effect, "joint": "joint"}
    write_verdict(folder, PENDULUM, causes=[cause], extended_simulation_rmse_rad={"joint": None})
    write_replay(folder, baseline, recording, PENDULUM)
    return find([folder])


def test_a_model_that_cannot_move_is_said_to_with_the_reason_where_its_numbers_are_missing(
    tmp_path,
):
    session = session_with(tmp_path, "backlash", play=0.01)
    assert refusal(session, RUN).startswith(
        "backlash at the joint: backlash can only be simulated for an exoskeleton's joints"
    )
    page = report(session)
    assert "With the causes this run could not be simulated" in page
    assert "can only be simulated for an exoskeleton" in page
    assert [tile.small for tile in tiles(session) if "simulated" in tile.title] == [
        "without the causes; with them it cannot be simulated"
    ]


def test_a_model_that_could_move_and_was_not_simulated_is_not_here_yet(tmp_path):
    session = session_with(tmp_path, "torque_offset", offset=0.1)
    assert refusal(session, RUN) == ""
    assert "Not here yet: this run, simulated with the causes" in report(session)


def test_a_run_that_was_simulated_with_the_causes_lacks_nothing(session_folder):
    assert refusal(find([session_folder]), RUN) == ""
    assert "simulated with the causes." not in report(find([session_folder]))


@pytest.mark.parametrize(
    ("away", "says"), [(0.5, "larger with the causes; only near"), (2.5, "larger with the causes")]
)
def test_the_row_in_which_the_causes_make_a_run_worse_says_so_and_whether_only_about_reversals(
    tmp_path, away, says
):
    folder = write_session(tmp_path / "leg")
    path = folder / "diagnosed" / "residuals.parquet"
    table = RESIDUALS.read(path)
    extended = table.frame["model"] == "extended"
    table.frame.loc[extended, "knee_residual_nm"] = table.frame.loc[extended, "scored"].map(
        {True: away, False: 5.0}
    )
    RESIDUALS.write(path, table.frame, table.metadata)
    notes = {score.words: score.note for score in scores(find([folder]), RUN)}
    assert notes["knee torque, computed, reversals included, N·m"].startswith(says)
    assert ("only" in notes["knee torque, computed, reversals included, N·m"]) == (away < 1)
    assert bool(notes["knee torque, computed, away from reversals, N·m"]) == (away > 1)
    assert not any(note for words, note in notes.items() if words.startswith("hip"))


def test_a_refit_of_the_causes_is_called_that_and_taken_for_no_baseline(tmp_path):
    write_session(tmp_path)
    diagnosed = tmp_path / "diagnosed" / "parameters.parquet"
    table = PARAMETERS.read(diagnosed)
    of = {"name": "parameters.parquet", "sha256": sha256(diagnosed)}
    inputs = [*table.metadata["inputs"], of]
    about = {k: v for k, v in table.metadata.items() if k != "contract"} | {
        "inputs": inputs,
        "method": {"causes": of},
    }
    PARAMETERS.write(tmp_path / "a_refit" / "parameters.parquet", table.frame, about)
    session = find([tmp_path])
    assert [model.title for model in models(session)] == [
        "Rigid body and friction",
        "With the named causes, refitted",
        "Extended by the named causes",
    ]
    assert [one.path.parent.name for one in session.baselines] == ["identified"]
    assert "--causes" in report(session)
