"""Translators of all instructions. To add one, write its function and enter it in the table of its module.

Source: LEGO's executable file specification.
"""

from __future__ import annotations

from collections.abc import Mapping

from sim_backend.firmware.vm.arithmetic import TABLE as ARITHMETIC
from sim_backend.firmware.vm.arrays import TABLE as ARRAYS
from sim_backend.firmware.vm.enhanced import TABLE as ENHANCED
from sim_backend.firmware.vm.flow import TABLE as FLOW
from sim_backend.firmware.vm.machine import Translate
from sim_backend.firmware.vm.ports import TABLE as PORTS
from sim_backend.firmware.vm.syscalls import TABLE as SYSCALLS
from sim_backend.firmware.vm.texts import TABLE as TEXTS

_TABLES = (ARITHMETIC, ARRAYS, ENHANCED, FLOW, PORTS, SYSCALLS, TEXTS)
OPCODES: Mapping[tuple[int, int], Translate] = {key: value for table in _TABLES for key, value in table.items()}
"""Opcode and number of arguments to the function that translates it."""
