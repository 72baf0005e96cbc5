"""Mailboxes of a running program: queues of five messages in its memory pool.

Source: docs/firmware.md section 4 (0x09, 0x13).
"""

from __future__ import annotations

from collections import deque

from sim_backend.firmware.vm.array_descriptor import NO_ARRAY
from sim_backend.firmware.vm.memory import Memory, OutOfMemory, PoolFull

MAILBOXES = 20
"""Ten to the program and ten from it."""

DEPTH = 5
LOG, LOG_DEPTH = MAILBOXES, 30
"""Number of the data log's queue, which keeps more."""

_BYTE = 1


class Mailboxes:
    """Twenty queues and that of the data log; a message beyond their size takes the array of the oldest."""

    def __init__(self, memory: Memory) -> None:
        self._memory = memory
        self._queues: list[deque[int]] = [deque() for _ in range(MAILBOXES + 1)]

    def write(self, box: int, message: bytes | memoryview) -> bool:
        """Append a message to a queue; return whether that dropped the oldest one.

        In a full pool all arrays move together, once for the descriptors and the bytes of the message.

        Raises:
            OutOfMemory: The pool is full.
        """
        memory, queue = self._memory, self._queues[box]
        full = len(queue) == (LOG_DEPTH if box == LOG else DEPTH)
        array = queue.popleft() if full else NO_ARRAY
        for may_compact in (True, False):
            try:
                if array == NO_ARRAY:
                    array = memory.new_array(_BYTE, may_compact=False)
                memory.set_bytes(array, message, may_compact=False)
                break
            except OutOfMemory as error:
                if not may_compact or not isinstance(error, PoolFull):
                    if array != NO_ARRAY:
                        memory.free_array(array)
                    raise
                memory.compact()
        queue.append(array)
        return full

    def read(self, box: int, *, remove: bool) -> bytes | None:
        """Return the oldest message of a queue, or None; only a further message removes an empty one.

        Raises:
            OutOfMemory: The program has corrupted its memory.
        """
        queue = self._queues[box]
        if not queue:
            return None
        message = self._memory.bytes_of(queue[0])
        if remove and message:
            self._memory.free_array(queue.popleft())
        return message
