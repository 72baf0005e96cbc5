"""Handlers of all instructions. To add one, write its function and enter it in the table of its module.

Source: LEGO's executable file specification.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sim_backend.firmware.vm.arithmetic import TABLE as ARITHMETIC
from sim_backend.firmware.vm.arrays import TABLE as ARRAYS
from sim_backend.firmware.vm.flow import TABLE as FLOW
from sim_backend.firmware.vm.machine import Instruction, Machine
from sim_backend.firmware.vm.ports import TABLE as PORTS
from sim_backend.firmware.vm.syscalls import call

OPCODES: Mapping[int, Callable[[Machine, Instruction], None]] = {
    **ARITHMETIC,
    **ARRAYS,
    **FLOW,
    **PORTS,
    0x28: call,
}
"""Opcode to handler."""
