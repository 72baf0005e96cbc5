"""Replay of recorded conversations with LEGO's firmware on the simulated brick: ``nxtdrive sim check``."""
