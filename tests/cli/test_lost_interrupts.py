"""Ctrl-C that falls into a callback of compiled code ends exoid as any other does."""

import ctypes

import pytest

from exoid_cli.lost_interrupts import interrupts_told
from pipelines.errors import DeviceError


def call_back(error):
    """Let compiled code call what raises, as LLVM does at the end of a compilation."""

    def fail():
        raise error

    ctypes.CFUNCTYPE(None)(fail)()


def test_a_failure_that_only_came_of_ctrl_c_is_told_as_ctrl_c_and_quietly(capfd):
    with pytest.raises(KeyboardInterrupt), interrupts_told():
        call_back(KeyboardInterrupt())
        raise RuntimeError("no compiled object yet")
    assert capfd.readouterr() == ("", "")


def test_what_a_device_or_exoid_did_wrong_is_told_as_that():
    with pytest.raises(DeviceError, match="USE THE EMERGENCY STOP"), interrupts_told():
        call_back(KeyboardInterrupt())
        raise DeviceError("USE THE EMERGENCY STOP: made up")
    with pytest.raises(RuntimeError, match="made up"), interrupts_told():
        raise RuntimeError("made up")


def test_other_errors_that_nobody_hears_are_shown_as_ever(monkeypatch):
    shown = []
    monkeypatch.setattr("sys.unraisablehook", lambda told: shown.append(told.exc_type))
    with interrupts_told():
        call_back(ValueError("made up"))
    assert shown == [ValueError]
