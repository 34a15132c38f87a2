"""exoid.toml: what it refuses, in full, and that nothing in it is undocumented."""

import re
from pathlib import Path

import pytest

from docs.site.setting_pages import PAGES, sections_of
from pipelines.contracts.inspection import inspect
from pipelines.errors import SettingsError
from pipelines.settings import Experiment, datasets
from pipelines.settings.base import models_in
from pipelines.settings.design import Bounds
from pipelines.settings.rig import RigSettings

ROOT = Path(__file__).parents[2]
DEFAULT = datasets() / "experiments" / "default.toml"
RUN = '[[run]]\nname = "a"\nrun = "exo_alone"\npurpose = "train"\n'
TABLES = list(sections_of(Experiment))


def test_the_default_file_says_what_the_defaults_are():
    assert Experiment.load(DEFAULT).model_dump() == Experiment().model_dump()


def test_a_file_that_begins_with_a_byte_order_mark_is_read_as_any_other(tmp_path):
    marked = tmp_path / "exoid.toml"
    marked.write_text(DEFAULT.read_text(encoding="utf-8"), encoding="utf-8-sig")
    assert Experiment.load(marked).model_dump() == Experiment.load(DEFAULT).model_dump()
    motion = tmp_path / "motion.toml"
    motion.write_text("omega_rad_s = 3.0\na = [[0.1]]\nb = [[0.1]]\n", encoding="utf-8-sig")
    assert inspect(motion).contract == "trajectory as TOML"


def test_a_thigh_that_no_leg_has_is_refused(tmp_path):
    (tmp_path / "exoid.toml").write_text("[mechanism]\nthigh_length_m = 389.52\n")
    with pytest.raises(
        SettingsError,
        match=r"mechanism\.thigh_length_m: found 389\.52, expected less than or equal to 5",
    ):
        Experiment.load(tmp_path / "exoid.toml")


def test_files_are_named_relative_to_the_experiment(tmp_path):
    (tmp_path / "exoid.toml").write_text("")
    assert (
        Experiment.load(tmp_path / "exoid.toml").file("rigs/a.toml") == tmp_path / "rigs" / "a.toml"
    )


@pytest.mark.parametrize(("heading", "model"), TABLES, ids=[heading for heading, _ in TABLES])
def test_every_key_stands_in_the_default_file_and_is_described(heading, model):
    text = DEFAULT.read_text(encoding="utf-8")
    keys = [
        name for name, field in model.model_fields.items() if not any(models_in(field.annotation))
    ]
    assert not keys or heading in text
    for key in keys:
        assert re.search(rf"^(# )?{key} = ", text, re.MULTILINE), f"{heading} {key}"
    assert all(field.description for field in model.model_fields.values())


@pytest.mark.parametrize("page", PAGES)
def test_a_page_of_keys_is_current(page):
    written = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    assert written == PAGES[page](), "run `make docs`"


def test_every_key_of_a_rig_file_has_a_description():
    tables = {RigSettings, *(model for _, model in sections_of(RigSettings))}
    fields = {
        f"{model.__name__}.{name}": field.description
        for model in tables
        for name, field in model.model_fields.items()
    }
    assert [name for name, description in fields.items() if not description] == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[desing]\n", "desing: unknown key; did you mean design?"),
        ("[design]\nharmonic = 3\n", "design.harmonic: unknown key; did you mean harmonics?"),
        (
            "[design]\nbase_frequency_rad_s = 0.6\n",
            "design.base_frequency_rad_s: unknown key; did you mean base_frequency_hz?",
        ),
        ("[design]\nharmonics = '3'\n", "design.harmonics: found '3', expected a valid integer"),
        ("[design]\nseed = true\n", "design.seed: found True, expected a valid integer"),
        ("[design]\nseconds = inf\n", "design.seconds: found inf, expected a finite number"),
        (
            "[filter]\ncutoff_hz = 'none'\n",
            "filter.cutoff_hz: found 'none', expected 'auto' or a valid number",
        ),
        (
            "[filter]\ncutoff_hz = -1\n",
            "filter.cutoff_hz: found -1, expected 'auto' or greater than 0",
        ),
        (
            "[design]\ncriterion = 'best'\n",
            "design.criterion: found 'best', expected 'log_det', 'condition',"
            " 'scaled_condition' or 'multisine'",
        ),
        (
            "[design]\nbase_frequency_hz = 20.0\nharmonics = 5\n",
            (
                "design: harmonics: the highest, 5, is at 100 Hz, expected less than half of"
                " sample_rate_hz, 100 Hz; lower harmonics or base_frequency_hz"
            ),
        ),
        (
            "[design.bounds.hip]\nangle_rad = [1.0, 0.5]\n",
            (
                "design.bounds.hip: angle_rad: found [1.0, 0.5], expected the lowest angle first;"
                " swap them"
            ),
        ),
        (
            "[design.bounds.hip]\nangle_deg = [5, 70]\n",
            "design.bounds.hip.angle_deg: unknown key; did you mean angle_rad? (and 1 more)",
        ),
        (
            "[design.bounds.hip]\nvelocity_rad_s = 1\n",
            "design.bounds.hip.angle_rad: missing; add it",
        ),
        ("run = []", "run: found no run, expected at least one; add a [[run]]"),
        (
            '[[mechanism.joints]]\nname = "a"\n[[mechanism.joints]]\nname = "a"\n',
            "mechanism: joints: found a twice, expected each name once; rename one",
        ),
        (
            '[mechanism]\nname = "sinlge"\n',
            (
                "mechanism: name: found 'sinlge' without joints, optional only for leg and"
                " single; add [[mechanism.joints]], or correct the name: did you mean single?"
            ),
        ),
        (
            '[mechanism]\nname = "Stage"\n',
            "mechanism.name: found 'Stage', expected text matching '^[a-z][a-z0-9_]*$'",
        ),
        (RUN + RUN, "run: found the name a twice, expected each once; rename one run"),
        (RUN.replace("name", "nam"), "run[0].nam: unknown key; did you mean name? (and 1 more)"),
        (
            RUN.replace('"a"', '"a b"'),
            "run[0].name: found 'a b', expected text matching '^[a-z0-9][a-z0-9_]*$'",
        ),
    ],
)
def test_a_bad_key_is_one_line_with_its_path(tmp_path, text, message):
    path = tmp_path / "exoid.toml"
    path.write_text(text)
    with pytest.raises(SettingsError) as caught:
        Experiment.load(path)
    assert str(caught.value) == f"{path}: {message}"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such file; `exoid init DIR` writes a commented one to start from"),
        (b"a = [", "is not valid TOML: Invalid value (at end of document); correct that line"),
        (b"\xff\xfe", "is not UTF-8 text, expected a TOML file; save it as UTF-8"),
    ],
)
def test_what_is_no_toml_is_refused(tmp_path, content, message):
    path = tmp_path / "exoid.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(SettingsError) as caught:
        Experiment.load(path)
    assert str(caught.value) == f"{path}: {message}"


def test_an_unknown_run_is_reported_with_the_known_ones():
    with pytest.raises(SettingsError, match=r"exoid\.toml: has no \[\[run\]\] named with_human; "):
        Experiment().run_named("with_human")


def test_bounds_in_degrees_are_refused_with_their_radians():
    with pytest.raises(ValueError, match=r"looks like degrees, write \[0.0873, 1.2217\]"):
        Bounds(angle_rad=(5.0, 70.0))


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ('[acquire]\nrig = "no.toml"', "acquire.rig: .*no.toml: no such file"),
        (
            (
                '[acquire]\nrig = "exoid.toml"\n[[run]]\nname = "a"\nrun = "exo_alone"\npurpose ='
                ' "train"\ntrajectory = "b.toml"'
            ),
            "run a.trajectory: .*b.toml: no such file",
        ),
        (
            '[acquire]\nrig = "exoid.toml"\n[filter]\ncutoff_hz = 100.0',
            "filter.cutoff_hz: found 100, expected less",
        ),
    ],
)
def test_what_cannot_run_is_refused_before_anything_runs(tmp_path, text, complaint):
    path = tmp_path / "exoid.toml"
    path.write_text(text)
    with pytest.raises(SettingsError, match=complaint):
        Experiment.load(path).refuse_what_cannot_run()
