"""Commands to a simulated brick, each of which takes a pass, and their replies."""

from firmware_protocol.status import Status


def ask(brick, command):
    """Return status and payload, as declared."""
    reply = _reply_to(brick, command)
    return Status(reply[2]), type(command).reply_type.unpack(reply)


def status_of(brick, command):
    """Return the status."""
    return Status(_reply_to(brick, command)[2])


def ask_bench(bench, command):
    """Return status and the bytes after it of the brick of a bench."""
    reply = bytes.fromhex(bench.telegram(command.encode().hex()))
    return reply[2], reply[3:]


def _reply_to(brick, command):
    reply = brick.receive(command.encode())
    brick.tick()
    return reply
