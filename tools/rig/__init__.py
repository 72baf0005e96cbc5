"""A virtual test bench: a stock Linux kernel in QEMU that has the simulated brick and its webcam on its USB.

Programs for developers of this project; they run in a checkout and are not installed. See docs/hil.md.
"""
