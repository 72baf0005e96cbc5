"""The simulated brick: the firmware's modules behind one link, in passes of one millisecond."""

from __future__ import annotations

from sim_backend.firmware.comm import Comm, Handlers
from sim_backend.firmware.direct_handlers import OutputHandlers
from sim_backend.firmware.output import MotorPlant, OutputModule

BOOT_MS = 6000
"""Passes from power-on until the brick is ready; the conversations start there."""


class SimBrick:
    """A brick that has been switched on six seconds ago.

    Attributes:
        now_ms: Milliseconds since power-on.
    """

    def __init__(
        self,
        *,
        firmware: str = "1.29",
        name: str = "NXT",
        address: bytes = bytes.fromhex("001653010203"),
        seed: int = 0,
    ) -> None:
        self.now_ms = BOOT_MS
        extended = firmware != "1.05"
        self.output = OutputModule(self.now_ms, stop_all_synchronised=extended)
        handlers: Handlers = {**OutputHandlers(self.output).table}
        self.comm = Comm(handlers, extended=extended)

    def receive(self, telegram: bytes) -> bytes | None:
        return self.comm.receive(telegram)

    def tick(self, passes: int = 1) -> None:
        end = self.now_ms + passes
        output = self.output
        while self.now_ms < end:
            self.now_ms = min(output.due_ms, end)
            output.run(self.now_ms)

    def attach_motor(self, port: str, plant: MotorPlant) -> None:
        self.output.outputs["ABC".index(port)].plant = plant
        self.output.wake()
