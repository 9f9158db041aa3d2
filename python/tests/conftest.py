"""Fixtures and helpers for all tests."""

import os
import signal
import threading
import time

import pytest


@pytest.fixture(autouse=True, scope="session")
def _ctrl_c_raises():
    """Restore the handler of SIGINT. Shells ignore it in background jobs, in which tests of Ctrl-C would wait forever."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def seconds_to_an_end():
    """Return a function that interrupts a computation by Ctrl-C after 0.3 s.

    The function returns the time (s) from Ctrl-C to KeyboardInterrupt.
    """

    def measure(compute):
        sent = []

        def interrupt():
            time.sleep(0.3)
            sent.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

        threading.Thread(target=interrupt).start()
        with pytest.raises(KeyboardInterrupt):
            compute()
        return time.monotonic() - sent[0]

    return measure
