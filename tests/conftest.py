"""What holds for every test."""

import signal

# A shell lets what it starts in the background ignore Ctrl-C, and so would the programs that tests start and stop.
signal.signal(signal.SIGINT, signal.default_int_handler)
