"""The volume and the sleep time-out that the menus store in a file. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from sim_backend.firmware.files.loader import Loader

SETTINGS = "NVConfig.sys"
"""File that the firmware creates at its first boot."""

SLEEP_MINUTES = (0, 2, 5, 10, 30, 60)
"""The sleep time-outs that the menus offer; the file has the number of one."""

_HAS_LOG, _VOLUME, _SLEEP, _LOGS = 1, 2, 3, slice(4, 6)
"""Bytes of the file of newer versions."""
_LAST_LOG = 9999
_BITS, _VOLUME_SHIFT = 7, 4
"""In the one byte of 1.05 the sleep time-out has the lowest bits, the volume some above."""
_LOUDEST, _LONGEST = 4, 5
"""The greatest of each that it accepts."""


class StoredSettings:
    """The settings as they were loaded at the start, or stored by the menus since then.

    They differ from those of the Ui map, which telegrams can change.

    Attributes:
        volume: The volume.
        sleep: The number of the sleep time-out.
    """

    def __init__(self, loader: Loader, preset: bytes) -> None:
        """Make settings that are not loaded yet.

        Args:
            loader: Holds the file.
            preset: Its content at the first boot.
        """
        self._loader, self._preset = loader, preset
        self._content = bytearray()
        self.volume = self.sleep = 0

    def load(self) -> None:
        """Read the file; it is created if there is no valid one."""
        loader, size = self._loader, len(self._preset)
        status, handle, _ = loader.open_read(SETTINGS)
        content = b"" if status else loader.read(handle, size)[1]
        loader.close(handle)
        self._content = bytearray((content if self._is_valid(content) else self._preset).ljust(size, b"\0"))
        self.volume, self.sleep = self._values(self._content)
        if not self._is_valid(content):
            self._replace()

    def save(self) -> None:
        """Store them in a new file, unless the old one is open."""
        content = self._content
        if self._is_packed:
            others = content[0] & ~(_BITS << _VOLUME_SHIFT | _BITS)
            content[0] = others | self.volume << _VOLUME_SHIFT | self.sleep
        else:
            content[_VOLUME], content[_SLEEP] = self.volume, self.sleep
        self._replace()

    @property
    def has_log(self) -> bool:
        """Whether the menus have the data log."""
        return not self._is_packed and bool(self._content[_HAS_LOG])

    @property
    def logs(self) -> int:
        """Number of data logs that were stored."""
        return int.from_bytes(self._content[_LOGS], "little")

    def count_log(self) -> None:
        """Count one more data log; after the last number the first one follows."""
        number = self.logs + 1 & 0xFFFF
        self._content[_LOGS] = (1 if number > _LAST_LOG else number).to_bytes(2, "little")
        self.save()

    def _replace(self) -> None:
        self._loader.replace(SETTINGS, bytes(self._content))

    def _values(self, content: bytes | bytearray) -> tuple[int, int]:
        """Return volume and number of the sleep time-out."""
        if self._is_packed:
            return content[0] >> _VOLUME_SHIFT & _BITS, content[0] & _BITS
        return content[_VOLUME], content[_SLEEP]

    def _is_valid(self, content: bytes) -> bool:
        """Return whether the firmware keeps a file: newer versions look at its format, 1.05 at its values."""
        if not content or not self._is_packed:
            return content[:1] == self._preset[:1]
        volume, sleep = self._values(content)
        return volume <= _LOUDEST and sleep <= _LONGEST

    @property
    def sleep_minutes(self) -> int:
        """The sleep time-out; for other numbers the firmware reads past the end of its table."""
        return SLEEP_MINUTES[self.sleep] if self.sleep < len(SLEEP_MINUTES) else 0

    @property
    def _is_packed(self) -> bool:
        return len(self._preset) == 1
