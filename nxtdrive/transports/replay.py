"""``replay://FILE``: a recording in place of a brick. The program must send the recorded requests in the same order.

Time is that of the recording: it jumps from one recorded event to the next. Keep-alives are ignored.

Motions depend on time: their requests vary with fractions of a millisecond. Recorded in the simulator they replay
exactly; recorded on a real clock, where each computation takes its own time, they do not.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Self, cast

from firmware_protocol import errors
from firmware_protocol.errors import AddressError, LinkError, LinkLost, LinkTimeout, NXTError, RemoteProtocolError
from firmware_protocol.explain import explain
from nxtdrive.transports.address import Address
from nxtdrive.transports.base import closed
from nxtdrive.transports.trace_file import HOUSEKEEPING, Entry, EntryKind, Trace, read_trace

EARLY_S = 0.001
"""Tolerance for replies recorded after the deadline: times are recorded after the call has returned."""
STEP_S = 0.001
"""Tolerance for the end of a pause: the simulator rounds to whole milliseconds."""


class ReplayTransport:
    """Replies as the recorded brick did.

    Args:
        trace: The recording.
        address: The address that opened it.
    """

    simulated = True

    def __init__(self, trace: Trace, address: str) -> None:
        self.address, self.max_telegram = address, trace.max_telegram
        self._command = trace.command
        self._entries = list(_replayable(trace.entries))
        self._next = 0
        self._now_s = 0.0
        self._open = True

    @classmethod
    def open(cls, address: Address, timeout_s: float = 1.0) -> Self:  # noqa: ARG003 - opened like any other
        """Open a recording.

        Raises:
            AddressError: The address names no file.
            ConfigError: The file cannot be read.
        """
        address.read_options({})
        if not address.target:
            raise AddressError(f"{address} names no file.", remedy="Write replay://FILE.nxttrace.")
        return cls(read_trace(Path(address.target)), str(address))

    def send(self, telegram: bytes) -> None:
        """Compare a telegram with the recorded request.

        Raises:
            LinkError: They differ, and the message shows both; or the recorded error.
        """
        self._check_open()
        if telegram == HOUSEKEEPING:
            return
        expected = self._peek()
        if expected is None or expected.kind in (EntryKind.FROM_BRICK, EntryKind.REOPENED):
            raise self._different(telegram, expected)
        if expected.kind is EntryKind.TO_BRICK and expected.telegram != telegram:
            raise self._different(telegram, expected)
        self._take(expected)
        if expected.error:
            raise _recorded(expected)

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the recorded reply if it arrived within `timeout_s`, else None.

        Raises:
            LinkTimeout: There is none, because the recording ends here.
            LinkError: The recorded error.
        """
        self._check_open()
        entry, deadline_s = self._peek(), self._now_s + timeout_s
        due = entry is not None and entry.time_s <= deadline_s + EARLY_S
        if entry is None or not due or entry.kind not in (EntryKind.FROM_BRICK, EntryKind.ERROR):
            self._pause_until(deadline_s)
            if entry is None:
                raise LinkTimeout("the recording ends here, without a reply to the last request.")
            return None
        self._take(entry)
        if entry.error:
            raise _recorded(entry)
        return entry.telegram

    def waiting(self) -> bool:
        """Return whether the program received something here, before its next request."""
        self._check_open()
        entry = self._peek()
        return entry is not None and entry.kind in (EntryKind.FROM_BRICK, EntryKind.ERROR)

    def close(self) -> None:
        """End the replay."""
        self._open = False

    def reopen(self, timeout_s: float = 1.0) -> Self:  # noqa: ARG002 - opened like any other
        """Continue after the point where the link was opened again.

        Raises:
            LinkLost: The recorded link was not opened again at this point.
        """
        entry = self._peek()
        if entry is None or entry.kind is not EntryKind.REOPENED:
            raise LinkLost("the link was not opened again at this point of the recording.")
        self._take(entry)
        again = copy(self)  # for the driver, the same object is the same link
        again._open = True
        return again

    def now(self) -> float:
        """Return the time in the recording, seconds."""
        return self._now_s

    def sleep(self, duration_s: float) -> None:
        """Advance the recording's time without waiting."""
        if duration_s > 0:
            self._pause_until(self._now_s + duration_s)

    def _pause_until(self, time_s: float) -> None:
        """Advance to `time_s`, or to the next recorded request if that is within the tolerance."""
        entry = self._peek()
        if entry and entry.kind is EntryKind.TO_BRICK and abs(entry.time_s - time_s) <= STEP_S:
            time_s = entry.time_s
        self._now_s = max(self._now_s, time_s)

    def _peek(self) -> Entry | None:
        return self._entries[self._next] if self._next < len(self._entries) else None

    def _take(self, entry: Entry) -> None:
        self._next += 1
        self._now_s = max(self._now_s, entry.time_s)

    def _check_open(self) -> None:
        if not self._open:
            raise closed(self.address)

    def _different(self, telegram: bytes, expected: Entry | None) -> NXTError:
        if expected is None:
            then = "the recording ends here"
        elif expected.kind is EntryKind.TO_BRICK:
            then = f"recorded is {in_words(expected.telegram)}"
        else:
            then = f"recorded is {expected.error or in_words(expected.telegram) or 'a new link'}"
        number = sum(entry.kind is EntryKind.TO_BRICK for entry in self._entries[: self._next]) + 1
        return LinkError(
            f"the program does not do what was recorded: its request {number} at {self._now_s:.3f} s is "
            f"{in_words(telegram)}, {then}.",
            remedy=f"Recorded was: nxtdrive {shlex.join(self._command)}." if self._command else "",
        )


def _replayable(entries: Iterable[Entry]) -> Iterator[Entry]:
    """Yield the entries without keep-alives; of one that failed, the error remains."""
    for entry in entries:
        if entry.telegram != HOUSEKEEPING:
            yield entry
        elif entry.error:
            yield replace(entry, kind=EntryKind.ERROR, telegram=b"")


def _recorded(entry: Entry) -> Exception:
    """Return the recorded error as an exception."""
    kind = getattr(errors, entry.error, LinkError)
    usable = isinstance(kind, type) and issubclass(kind, LinkError | RemoteProtocolError)
    return cast("Exception", (kind if usable else LinkError)(entry.text))


def in_words(telegram: bytes) -> str:
    """Format a telegram in one line: its name, its fields, its bytes."""
    if not telegram:
        return ""
    explained = explain(telegram)
    status = "" if explained.status is None else f" {explained.status.label}"
    fields = "".join(f" {field.name}={field.text}" for field in explained.fields)
    return f"{explained.name or explained.kind}{status}{fields} ({telegram.hex(' ')})"
