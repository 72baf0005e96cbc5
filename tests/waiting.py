"""Waiting for what another thread or program does."""

import threading
import time

PATIENCE_S = 30.0


def until(happens):
    """Wait until something happens, and return it."""
    latest_s = time.monotonic() + PATIENCE_S
    while not (happened := happens()):
        assert time.monotonic() < latest_s, "it never came"
        threading.Event().wait(0.005)
    return happened
