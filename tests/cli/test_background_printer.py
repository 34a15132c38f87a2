"""A line that is printed in the background never holds up the work that it reports."""

import threading

from exoid_cli.background_printer import BackgroundPrinter


def test_lines_are_printed_in_their_order():
    printed = []
    with BackgroundPrinter(printed.append) as printer:
        for k in range(50):
            printer.print(str(k))
    assert printed == [str(k) for k in range(50)]


def test_an_output_that_is_stuck_holds_up_nobody():
    released, printed = threading.Event(), []

    def write(text):
        released.wait()
        printed.append(text)

    # Were print or the block's end to wait for the output, the test would never end.
    with BackgroundPrinter(write, waiting=100, closing_s=0.1) as printer:
        for k in range(1000):
            printer.print(str(k))
    assert printed == []
    released.set()


def test_an_output_that_is_closed_is_no_error():
    def write(text):
        raise BrokenPipeError

    with BackgroundPrinter(write) as printer:
        for _ in range(10):
            printer.print("on")
