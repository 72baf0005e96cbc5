"""The loader module, which owns the flash: how much is free. Source: docs/firmware.md section 5, "File system"."""

from __future__ import annotations

_FREE_AFTER_BOOT = {"1.29": 120_868, "1.05": 124_424}
"""Bytes free with nothing but the settings file that the first boot makes."""


class Loader:
    """The flash of a brick without user files.

    Attributes:
        free_flash: Bytes.
    """

    def __init__(self, firmware: str) -> None:
        self.free_flash = _FREE_AFTER_BOOT[firmware]
