"""Which instruction does what. To add one, write its function and enter it in the table of its file.

Source: LEGO's executable file specification.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sim_backend.firmware.vm import arithmetic, arrays, flow, ports, syscalls
from sim_backend.firmware.vm.machine import Instruction, Machine

OPCODES: Mapping[int, Callable[[Machine, Instruction], None]] = {
    **arithmetic.TABLE,
    **arrays.TABLE,
    **flow.TABLE,
    **ports.TABLE,
    0x28: syscalls.call,
}
"""Opcode to handler."""
