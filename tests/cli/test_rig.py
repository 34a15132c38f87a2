"""``exoid rig``: serve and check."""

import pytest


@pytest.mark.parametrize("verb", [[], ["serve"]])
def test_a_rig_file_is_served_with_and_without_the_verb(exoid, monkeypatch, tmp_path, verb):
    asked = []
    monkeypatch.setattr("pipelines.rig.server.serve_file", lambda *given, **named: asked.append(given[:2]))
    assert exoid("rig", *verb, tmp_path / "rig.toml", "--run", "exo_alone").code == 0
    assert asked == [(tmp_path / "rig.toml", "exo_alone")]
