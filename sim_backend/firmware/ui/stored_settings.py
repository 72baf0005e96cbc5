"""The volume and the sleep time-out that the menus store in a file. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from sim_backend.firmware.files.flash import SETTING_BITS, SETTINGS, VOLUME_SHIFT
from sim_backend.firmware.files.loader import Loader

SLEEP_MINUTES = (0, 2, 5, 10, 30, 60)
"""The sleep time-outs that the menus offer; the file has the number of one."""

_VOLUME, _SLEEP = 2, 3
"""Bytes of the file of newer versions."""


class StoredSettings:
    """The settings as they were loaded at the start, or stored by the menus since then.

    They are not those of the Ui map, which telegrams can change.

    Attributes:
        volume: The volume.
        sleep: The number of the sleep time-out.
    """

    def __init__(self, loader: Loader) -> None:
        self._loader = loader
        self._content = bytearray()
        self.volume = self.sleep = 0

    def load(self) -> None:
        """Read the file; it is created if there is no valid one."""
        self._content = content = bytearray(self._loader.restore_settings())
        if self._is_packed:
            self.volume, self.sleep = content[0] >> VOLUME_SHIFT & SETTING_BITS, content[0] & SETTING_BITS
        else:
            self.volume, self.sleep = content[_VOLUME], content[_SLEEP]

    def save(self) -> None:
        """Store them in a new file, unless the old one is open."""
        content, loader = self._content, self._loader
        if self._is_packed:
            others = content[0] & ~(SETTING_BITS << VOLUME_SHIFT | SETTING_BITS)
            content[0] = others | self.volume << VOLUME_SHIFT | self.sleep
        else:
            content[_VOLUME], content[_SLEEP] = self.volume, self.sleep
        loader.delete(SETTINGS)
        status, handle, _ = loader.create(SETTINGS, len(content))
        if not status:
            loader.write(handle, bytes(content))
            loader.close(handle)

    @property
    def sleep_minutes(self) -> int:
        """The sleep time-out; for other numbers the firmware reads past the end of its table."""
        return SLEEP_MINUTES[self.sleep] if self.sleep < len(SLEEP_MINUTES) else 0

    @property
    def _is_packed(self) -> bool:
        return len(self._content) == 1
