from datetime import datetime

import numpy

from pipelines.contracts import RECORDING, describe


def test_a_result_names_its_inputs_by_name_and_hash(tmp_path, swinging_leg, run_metadata):
    source = tmp_path / "secret place" / "a.txt"
    source.parent.mkdir()
    source.write_text("abc")
    origin = describe(inputs=[source], config={"order": 4})
    # SHA-256 of "abc": FIPS 180-2, appendix B.1
    digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert origin["inputs"] == [{"name": "a.txt", "sha256": digest}]
    assert origin["created_by"] == "exoid 0.1.0"
    assert datetime.fromisoformat(origin["created_at"]).utcoffset().total_seconds() == 0
    assert origin["software"]["numpy"] == numpy.__version__
    RECORDING.write(tmp_path / "r.parquet", swinging_leg, run_metadata | origin)
    assert RECORDING.read(tmp_path / "r.parquet").metadata["config"] == {"order": 4}
