"""What all tests need."""

import os
import signal
import threading
import time

import pytest


@pytest.fixture(autouse=True, scope="session")
def _ctrl_c_raises():
    """Shells start background jobs with SIGINT ignored: tests of Ctrl-C would wait for ever."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def seconds_to_an_end():
    """Computes until Ctrl-C comes after 0.3 s; the time from there to KeyboardInterrupt, s."""

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
