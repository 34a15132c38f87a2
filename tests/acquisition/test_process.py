"""``exoid acquire`` as a process of its own: with its embedded rig, under signals, and killed."""

import fcntl
import os
import re
import signal
import socket
import subprocess
import sys
import termios
import time

import numpy as np
import pytest
from pymodbus.client import ModbusTcpClient

from pipelines.contracts import RECORDING
from pipelines.contracts.run_paths import journal_of
from pipelines.settings import datasets
from tests.acquisition.conftest import free_port
from tests.acquisition.journals import read_journal

pytestmark = pytest.mark.long

SLOW_HZ = 50.0
"""Of runs in real time: four times as long for a cycle as by default, for a busy computer."""


@pytest.fixture
def experiment(tmp_path, excitation):
    """Write an experiment on a shipped rig; returns the arguments that record its one run."""

    def write(shipped, duration_s, run="exo_alone", sample_rate_hz=200.0, **changes):
        text = (datasets() / "rigs" / f"{shipped}.toml").read_text()
        for key, value in {"ramp_s": 0.5, "settle_s": 0.1, **changes}.items():
            text = re.sub(rf"^{key} = [^#\n]*", f"{key} = {value} ", text, flags=re.MULTILINE)
        (tmp_path / "rig.toml").write_text(text)
        sealed = datasets() / "rigs" / "sealed" / "default.toml"
        (tmp_path / "sealed").mkdir()
        (tmp_path / "sealed" / "default.toml").write_text(sealed.read_text())
        config = tmp_path / "exoid.toml"
        config.write_text(
            f'[acquire]\nrig = "rig.toml"\nsample_rate_hz = {sample_rate_hz}\n[[run]]\nname ='
            f' "one"\nrun = "{run}"\npurpose = "train"\nduration_s = {duration_s}\nseed = 3\n'
        )
        output = tmp_path / "recordings" / "one.parquet"
        return [
            "acquire",
            "--config",
            config,
            "--run",
            "one",
            "--trajectory",
            excitation,
            "-o",
            output,
        ], output

    return write


@pytest.fixture
def start():
    """Start exoid; whatever is still running at the test's end is killed."""
    started = []

    def run(arguments):
        command = [sys.executable, "-m", "exoid_cli.app", *map(str, arguments)]
        started.append(
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        )
        return started[-1]

    yield run
    for process in started:
        process.kill()
        process.communicate()


def wait_for_rows(process, output, rows):
    """Wait until a run has written so many rows."""
    while process.poll() is None:
        time.sleep(0.1)
        path = journal_of(output)
        if path.exists() and path.stat().st_size and len(read_journal(path)[0]) >= rows:
            return
    raise AssertionError(f"the run ended early: {process.stderr.read()}")


def rigs_of(folder):
    """Return the processes that serve a rig file below a folder."""
    found = []
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                with open(f"/proc/{entry}/cmdline", "rb") as file:
                    words = file.read().split(b"\0")
            except OSError:
                continue
            if b"rig" in words and any(word.startswith(str(folder).encode()) for word in words):
                found.append(int(entry))
    return found


def ended(folder):
    until = time.monotonic() + 10
    while time.monotonic() < until and rigs_of(folder):
        time.sleep(0.05)
    return not rigs_of(folder)


def said(err):
    """Return what was said besides that the rig takes its time to start, which a busy computer
    says."""
    return "".join(
        line
        for line in err.splitlines(keepends=True)
        if not line.startswith("starting the virtual rig")
    )


def test_the_default_rig_is_started_recorded_and_ended_and_tells_nothing_sealed(
    start, experiment, tmp_path
):
    arguments, output = experiment("default", 2.0, run="with_human")
    process = start(arguments)
    out, err = process.communicate(timeout=120)
    assert (process.returncode, said(err)) == (0, "")
    assert "400 samples of run one, 0 missed" in out
    table = RECORDING.read(output)
    assert table.metadata["run"] == "with_human"
    assert [entry["name"] for entry in table.metadata["inputs"]] == ["excitation.toml", "rig.toml"]
    assert os.listdir(output.parent) == ["one.parquet"]
    assert ended(tmp_path)
    told = output.read_bytes().decode(errors="replace") + str(table.metadata) + out
    for secret in (
        "sealed",
        "stribeck",
        "presliding",
        "elasticity",
        "encoder_offset",
        "inertial",
        "coulomb",
    ):
        assert secret not in told


@pytest.mark.parametrize(
    ("number", "name"),
    [
        (signal.SIGINT, "Ctrl-C"),
        pytest.param(signal.SIGTERM, "SIGTERM", marks=pytest.mark.slow),
        pytest.param(signal.SIGQUIT, "SIGQUIT", marks=pytest.mark.slow),
        pytest.param(signal.SIGHUP, "SIGHUP", marks=pytest.mark.slow),
        pytest.param(signal.SIGTSTP, "Ctrl-Z", marks=pytest.mark.slow),
    ],
)
def test_a_signal_stops_the_leg_keeps_the_record_and_says_so_in_one_line(
    start, experiment, tmp_path, number, name
):
    arguments, output = experiment("plain", 4000.0)
    process = start(arguments)
    wait_for_rows(process, output, 100)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    kept = output.with_name("one.aborted.parquet")
    table = RECORDING.read(kept)
    assert process.returncode == 3
    assert (
        said(err).strip()
        == f"exoid: stopped by {name}; the leg was stopped, its {len(table.frame)} samples so far"
        f" are in {kept}"
    )
    assert table.metadata["abort"] == f"stopped by {name}"
    assert len(table.frame) >= 100
    assert ended(tmp_path)


@pytest.fixture
def start_on_a_terminal():
    """Start exoid on a terminal of its own; returns the process and the end that closes the
    terminal."""
    started = []

    def run(arguments):
        here, there = os.openpty()
        command = [sys.executable, "-m", "exoid_cli.app", *map(str, arguments)]
        process = subprocess.Popen(
            command,
            stdin=there,
            stdout=there,
            stderr=there,
            env=os.environ | {"TERM": "xterm"},
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )
        os.close(there)
        started.append(process)
        return process, here

    yield run
    for process in started:
        process.kill()
        process.wait()


def test_a_terminal_that_is_closed_stops_the_leg_and_its_silence_is_no_fault_of_exoids(
    start_on_a_terminal, experiment, tmp_path
):
    arguments, output = experiment("plain", 4000.0)
    process, terminal = start_on_a_terminal(arguments)
    wait_for_rows(process, output, 100)
    os.close(terminal)
    assert process.wait(timeout=60) == 3
    table = RECORDING.read(output.with_name("one.aborted.parquet"))
    assert table.metadata["abort"] == "stopped by SIGHUP"
    assert os.listdir(output.parent) == ["one.aborted.parquet"]
    assert ended(tmp_path)


def test_a_folder_that_vanishes_stops_the_leg_and_hides_neither_why_nor_how_it_was_left(
    start, experiment, tmp_path
):
    arguments, output = experiment("plain", 4000.0)
    process = start(arguments)
    wait_for_rows(process, output, 100)
    output.parent.rename(tmp_path / "moved")
    _, err = process.communicate(timeout=60)
    assert process.returncode == 3
    assert "it was removed or moved while the run went on" in err
    assert f"the leg was stopped; its samples are not in {journal_of(output)} any more" in err
    assert len(read_journal(tmp_path / "moved" / journal_of(output).name)[0]) >= 100


def test_a_signal_while_a_silent_device_is_waited_for_before_anything_moves_ends_it_at_once(
    start, rig_file, excitation, tmp_path
):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        rig = rig_file(shipped="real_time", port=silent.getsockname()[1], connect_s=50.0)
        config = tmp_path / "exoid.toml"
        config.write_text(
            f'[acquire]\nrig = "{rig.name}"\n[[run]]\nname = "one"\nrun = "exo_alone"\npurpose ='
            ' "train"\nduration_s = 1.0\nseed = 3\n'
        )
        process = start(
            [
                "acquire",
                "--config",
                config,
                "--run",
                "one",
                "--trajectory",
                excitation,
                "-o",
                tmp_path / "one.parquet",
            ]
        )
        connection, _ = silent.accept()
        with connection:
            connection.recv(12)  # it asks, and waits for an answer
            process.send_signal(signal.SIGTERM)
            _, err = process.communicate(timeout=20)
    assert process.returncode == 3
    assert err == "exoid: stopped by SIGTERM before the drives were enabled; nothing was moved\n"


def test_a_killed_run_loses_no_more_than_half_a_second(start, experiment, tmp_path):
    arguments, output = experiment(
        "real_time",
        60.0,
        sample_rate_hz=SLOW_HZ,
        torque_nm=1000.0,
        speed_rad_s=50.0,
        watchdog_s=2.0,
        heartbeat_s=1.0,
    )
    process = start(arguments)
    wait_for_rows(process, output, 1)
    began = time.monotonic()
    time.sleep(1.0)
    process.kill()
    killed = time.monotonic()
    process.communicate()
    frame, metadata = read_journal(journal_of(output))
    assert metadata["run"] == "exo_alone"
    assert frame["time_s"].iloc[-1] > killed - began - 0.5
    assert np.isfinite(frame["hip_torque_nm"]).all()
    assert ended(tmp_path)
    again = start(arguments)
    _, err = again.communicate(timeout=60)
    assert again.returncode == 2
    assert f"{journal_of(output)}: holds {len(frame)} samples" in err
    assert len(said(err).strip().splitlines()) == 1


def test_a_rig_file_with_a_fault_in_its_plant_is_the_users_to_mend(start, experiment):
    arguments, _ = experiment("plain", 1.0, exo_inertial="[1.0, -0.22, 0.55, 2.3]")
    process = start(arguments)
    _, err = process.communicate(timeout=60)
    assert "plant.exo_inertial: no real leg has these" in err
    assert (process.returncode, len(said(err).strip().splitlines())) == (2, 1)


def status_of(client, unit):
    """Return set-point and status word of a shipped rig's drive."""
    words = client.read_holding_registers(110, count=4, device_id=unit).registers
    reference = client.convert_from_registers(words[:2], client.DATATYPE.INT32)
    return reference * 1e-6, words[3]


def test_when_the_host_is_killed_the_drives_stop_the_leg_and_disable_themselves(
    start, rig_file, excitation, tmp_path
):
    port, heartbeat_s = free_port(), 1.5
    rig = rig_file(
        shipped="real_time",
        port=port,
        heartbeat_s=heartbeat_s,
        watchdog_s=2.0,
        torque_nm=1000.0,
        speed_rad_s=50.0,
    )
    config = tmp_path / "exoid.toml"
    config.write_text(
        f'[acquire]\nrig = "{rig.name}"\nsample_rate_hz = {SLOW_HZ}\n[[run]]\nname = "one"\nrun ='
        ' "exo_alone"\npurpose = "train"\nduration_s = 300.0\nseed = 3\n'
    )
    serving = start(["rig", "serve", rig, "--run", "exo_alone", "--rate-hz", SLOW_HZ])
    assert str(port) in serving.stdout.readline() + serving.stdout.readline()
    output = tmp_path / "one.parquet"
    arguments = [
        "acquire",
        "--config",
        config,
        "--run",
        "one",
        "--trajectory",
        excitation,
        "-o",
        output,
    ]
    acquiring = start(arguments)
    wait_for_rows(acquiring, output, 50)
    with ModbusTcpClient("127.0.0.1", port=port) as client:
        assert [status_of(client, unit)[1] for unit in (1, 2)] == [0x0001] * 2
        acquiring.kill()
        killed, seen = time.monotonic(), []
        while time.monotonic() - killed < heartbeat_s + 1.0:
            seen.append((time.monotonic() - killed, *status_of(client, 1), status_of(client, 2)[1]))
            time.sleep(0.01)
    at, reference, hip, knee = np.transpose(seen)
    # As docs/safety.md states it, and some time for a busy computer: at rest after five samples and
    # the slowing down.
    before = (at > 0.5 + 5 / SLOW_HZ + 1.3 / 8.0) & (hip == 0x0001)
    assert before.any() and np.ptp(reference[before]) < 1e-5
    for status in (hip, knee):
        assert (status[at > heartbeat_s + 0.5] == 0x0008).all()
    again = start([*arguments[:-1], tmp_path / "two.parquet"])
    _, err = again.communicate(timeout=60)
    assert again.returncode == 3
    assert "reports a fault (status bits 0x0008)" in err and "--reset-faults" in err
    config.write_text(config.read_text().replace("300.0", "1.0"))
    again = start([*arguments[:-1], tmp_path / "two.parquet", "--reset-faults"])
    _, err = again.communicate(timeout=60)
    assert again.returncode == 0
    # On a busy computer a run in real time may miss a sample or leave a set-point out, and tells
    # so: no fault of a drive is left to tell.
    missed = "samples were missed", "set-points were left out"
    assert all(any(words in line for words in missed) for line in err.splitlines()), err
