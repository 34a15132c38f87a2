import threading
import time

from exoid_cli import aside
from exoid_cli.aside import Aside


def test_lines_are_said_in_their_order():
    said = []
    with Aside(said.append) as lines:
        for k in range(50):
            lines.say(str(k))
    assert said == [str(k) for k in range(50)]


def test_a_reader_that_has_stopped_holds_up_nobody(monkeypatch):
    monkeypatch.setattr(aside, "CLOSING_S", 0.1)
    goes_on, said = threading.Event(), []

    def say(text):
        goes_on.wait(60)
        said.append(text)

    began = time.monotonic()
    with Aside(say) as lines:
        for k in range(10 * aside.MOST_WAITING):
            lines.say(str(k))
    assert time.monotonic() - began < 30
    assert said == []
    goes_on.set()


def test_a_reader_that_has_gone_is_no_error():
    def say(text):
        raise BrokenPipeError

    with Aside(say) as lines:
        for _ in range(10):
            lines.say("on")
