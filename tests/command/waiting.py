# SPDX-License-Identifier: Apache-2.0
"""Waiting for a state that no call reports: a file, a line of a log, a process's state."""
import time

# Only what hangs reaches it: a search on a simulated rig can take 30 s on an idle machine.
TIMEOUT_S = 180


def wait_until(condition, message="waited in vain", timeout_s=TIMEOUT_S, interval_s=0.01):
    """Returns the first true value of condition(); fails after `timeout_s`. `message` may be a
    function."""
    end = time.monotonic() + timeout_s
    while not (value := condition()):
        if time.monotonic() > end:
            raise AssertionError(message() if callable(message) else message)
        time.sleep(interval_s)
    return value
