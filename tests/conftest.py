"""What holds for all tests."""

import signal

# A shell starts what it puts into the background with Ctrl-C ignored; the tests of Ctrl-C need Python's own handler.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
