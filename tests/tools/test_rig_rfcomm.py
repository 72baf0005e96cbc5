"""The end of the Bluetooth adapter: the kernel loses it."""

import socket
import time

import pytest

pytest.importorskip("bumble", reason="no bumble: pip install nxtdrive[hil]")


@pytest.mark.slow
def test_a_kernel_loses_the_adapter_when_the_door_closes():
    from nxtdrive.tools.rig.rfcomm import RfcommDoor

    door = RfcommDoor("00:16:53:01:02:03", now=time.monotonic)
    with socket.create_connection(("127.0.0.1", door.port), timeout=30) as kernel:
        reset = b"\x01\x03\x0c\x00"
        kernel.sendall(len(reset).to_bytes(2, "little") + reset)
        assert kernel.recv(100)
        door.close()
        assert kernel.recv(100) == b""
