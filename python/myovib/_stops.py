"""Messages of integrations that stop."""

from __future__ import annotations

import re

# Message of IDAS if all attempts at the first step fail the error test. The group matches the step size of the last attempt.
FAILED_AT_START = re.compile(r"after 0 steps .*error_test_failures.* h = -?([-+.\de]+), the error test")

# Beginning of messages that contain the time of the last step. This time may be after the last output time.
STOPPED = re.compile(r"(?:stopped|the limit .* was reached) at t = ([-+.\de]+)")

# Beginning of the message if no consistent values are found after a break.
VALUELESS = "no consistent initial values"

# Part of the message if steps become too short, and part of the message if no step is accepted.
TOO_SMALL = "step_too_small"
NO_STEPS = "after 0 steps"

# Number of steps per failure of Newton's method below which the Jacobian may be inaccurate.
FREQUENT = 5


def fails_to_converge(message: str) -> bool:
    """Return whether the message reports that Newton's method failed or that derivatives changed abruptly."""
    return "converge" in message or "abruptly" in message
