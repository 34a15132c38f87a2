import socket

import pytest

from pipelines.acquisition.check import survey
from pipelines.acquisition.check.check import check_rig
from pipelines.rig.device import Device


@pytest.fixture
def checked(rig_file, serve, monkeypatch):
    """Check a rig that swings out, against a rig file; returns the report.

    ``believed`` are changes of the file, not of the rig that is there; ``served`` are changes of
    both; ``options`` are those of the check; ``on_a_line`` puts all devices on one, with
    the changes ``changed_line``.
    """

    def run(
        shipped="plain",
        believed=None,
        served=None,
        fault=None,
        options=None,
        on_a_line=False,
        changed_line=None,
        real_hz=40.0,
        **changes,
    ):
        replace = dict(served or {})
        if shipped == "real_time":  # slow, for a busy computer
            replace["[plant]\n"] = f"[plant]\nsample_rate_hz = {real_hz}\n"
        monkeypatch.setattr(survey, "TOGETHER_S", 1.0 if shipped == "real_time" else 0.3)
        monkeypatch.setattr(survey, "DRIVES_S", 0.1)
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        changes = {"watchdog_s": 10.0, "rest_rad": "[0.4, -0.6]", **changes}
        rig = rig_file(shipped, port, replace, **changes)
        seen = rig_file(shipped, port, replace | (believed or {}), **changes)
        if on_a_line:
            line = f'\n[line.leg]\ntransport = "tcp"\nhost = "127.0.0.1"\nport = {port}\n'
            for was, believed_line in (changed_line or {}).items():
                line = line.replace(was, believed_line)
            seen.write_text(seen.read_text().replace(f"port = {port}\n", 'line = "leg"\n') + line)
        options = options or {}
        with serve(rig, port, options.get("run", "exo_alone"), fault=fault):
            return check_rig(seen, **options)

    return run


@pytest.fixture
def altered(monkeypatch):
    """Let devices report altered values: ``change(device, values)`` alters them in place."""

    def alter(change):
        put = Device._put

        def altered_put(self, block, values):
            change(self, values)
            put(self, block, values)

        monkeypatch.setattr(Device, "_put", altered_put)

    return alter
