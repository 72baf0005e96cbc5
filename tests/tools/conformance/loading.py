"""Programs on a bench."""

from firmware_protocol.direct import StartProgram
from firmware_protocol.system import Close, OpenWrite, Write

NAME, PIECE = "a.rxe", 58


def start(bench, program):
    """Put a program on the brick of a bench, as a download does, and start it."""
    pieces = (program[at : at + PIECE] for at in range(0, len(program), PIECE))
    requests = [OpenWrite(NAME, len(program)), *(Write(0, piece) for piece in pieces), Close(0), StartProgram(NAME)]
    for request in requests:
        bench.telegram(request.encode().hex())
