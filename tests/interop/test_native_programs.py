"""Programs that are not Python, and the real libusb, with the simulated brick on a USB bus made by umockdev."""

import json
import random
import re
import shutil
import signal
import subprocess
import sys
from ctypes.util import find_library
from importlib.util import find_spec
from pathlib import Path

import pytest

from nxtdrive.cli.commands.sim_exec import umockdev_interpreter

PATIENCE_S = 60

pytestmark = pytest.mark.skipif(
    umockdev_interpreter() is None, reason="no umockdev (Debian: apt install python3-gi gir1.2-umockdev-1.0)"
)
needs_t2n = pytest.mark.skipif(shutil.which("t2n") is None, reason="t2n is not installed (Debian: apt install t2n)")
needs_nbc = pytest.mark.skipif(shutil.which("nbc") is None, reason="nbc is not installed (Debian: apt install nbc)")
needs_libusb = pytest.mark.skipif(
    find_library("usb-1.0") is None, reason="libusb is not installed (Debian: apt install libusb-1.0-0)"
)


@pytest.fixture
def execute(tmp_path):
    """Runs a program by ``sim exec --native`` in an empty folder; returns the finished process."""

    def run(*program):
        command = [sys.executable, "-m", "nxtdrive", "sim", "exec", "--native", "--world", "open", "--"]
        return subprocess.run(
            [*command, *program],
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE_S,
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
        )

    return run


@needs_t2n
def test_t2n_prints_the_bricks_identity(execute):
    done = execute("t2n", "-i")
    assert "protocol version=1.124 firmware version=1.29" in done.stdout
    assert "NXT Name: NXT" in done.stdout
    assert done.returncode == 0


@needs_t2n
def test_t2n_sends_a_file_and_gets_it_back(execute, tmp_path):
    content = random.Random(1).randbytes(1000)
    (tmp_path / "up.bin").write_bytes(content)
    (tmp_path / "down").mkdir()
    done = execute("sh", "-c", "t2n -put up.bin && t2n -ls && cd down && t2n -get up.bin")
    assert done.returncode == 0, done.stderr
    assert 'FILE:"up.bin" SIZE:1000' in done.stdout
    assert (tmp_path / "down" / "up.bin").read_bytes() == content


@needs_nbc
@needs_t2n
def test_the_nxc_compiler_downloads_what_it_has_compiled(execute, tmp_path):
    (tmp_path / "drive.nxc").write_text("task main() { OnFwd(OUT_A, 75); Wait(500); Off(OUT_A); }\n")
    subprocess.run(["nbc", "-O=local.rxe", "drive.nxc"], cwd=tmp_path, check=True, capture_output=True, timeout=60)
    done = execute("sh", "-c", "nbc -S=usb -d drive.nxc && t2n -get drive.rxe")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "drive.rxe").read_bytes() == (tmp_path / "local.rxe").read_bytes()


ENDS_FIRST = """
import gc
from nxtdrive.transports.usb_port import UsbTransport, _bricks, _fresh_backend
from nxtdrive.transports.address import Address
for round in range(3):
    context = _fresh_backend()
    [brick] = _bricks(context)
    print(brick.serial_number)
    context.finalize()
    del brick
    gc.collect()
transport = UsbTransport.open(Address.parse("usb://"))
transport._device.backend.finalize()
transport.close()
print("closed")
"""


@needs_libusb
def test_a_context_that_ends_before_its_devices_does_no_harm(execute):
    done = execute(sys.executable, "-c", ENDS_FIRST)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [*["001653010203"] * 3, "closed"]


WATCH = """
import usb.core
brick = usb.core.find(idVendor=0x0694)
def ask(*telegram):
    brick.write(0x01, bytes(telegram))
    return bytes(brick.read(0x82, 64))
names, counts = set(), []
for _ in range(5000):
    running = ask(0x00, 0x11)
    if running[2]:
        if names:
            break
        continue
    names.add(running[3:].split(b"\\0")[0].decode())
    counts.append(int.from_bytes(ask(0x00, 0x06, 0x00)[13:17], "little", signed=True))
print(*names, max(counts))  # the end of a program resets the counters
"""


@needs_nbc
@needs_libusb
def test_an_nxc_program_is_compiled_downloaded_started_and_turns_a_motor(execute, tmp_path):
    (tmp_path / "turn.nxc").write_text("task main() { OnFwd(OUT_A, 75); Wait(500); Off(OUT_A); Wait(1500); }\n")
    (tmp_path / "watch.py").write_text(WATCH)
    done = execute("sh", "-c", f"nbc -S=usb -r turn.nxc > log && {sys.executable} watch.py")
    assert done.returncode == 0, done.stderr
    name, count_deg = done.stdout.split()
    assert name == "turn.rxe"
    # half a second at 75 %, some 9 deg/s each, less what it takes to get going
    assert 150 < int(count_deg) < 500


@needs_libusb
@pytest.mark.skipif(find_spec("nxt") is None, reason="nxt-python is not installed (pip install .[test])")
def test_nxt_python_works_through_the_real_libusb(execute):
    done = execute(sys.executable, "-c", "from nxt.command.test import run; run()", "--backend", "usb")
    assert done.returncode == 0, done.stderr
    assert "Firmware version 1.29" in done.stdout


@needs_libusb
def test_our_own_driver_works_through_the_real_libusb(execute):
    done = execute(sys.executable, "-m", "nxtdrive", "info", "--nxt", "usb://001653010203", "--json")
    assert json.loads(done.stdout)["firmware"] == "1.29"


@needs_libusb
@pytest.mark.slow
def test_the_transport_contract_holds_on_the_real_libusb(execute):
    contract = str(Path(__file__).resolve().parents[1] / "contract" / "test_transport_contract.py")
    done = execute(sys.executable, "-m", "pytest", "-n", "0", "-p", "no:cacheprovider", contract, "--nxt", "usb://")
    assert done.returncode == 0, done.stdout
    assert re.search(r"\d+ passed", done.stdout)


@pytest.mark.parametrize(("end", "code"), [("exit 7", 7), ("kill -KILL $$", 128 + signal.SIGKILL)])
def test_the_exit_code_is_the_programs(execute, end, code):
    assert execute("sh", "-c", end).returncode == code


@needs_t2n
@needs_libusb
def test_only_one_program_at_a_time_has_the_brick(execute):
    program = """
import subprocess, usb.core
brick = usb.core.find(idVendor=0x0694)
brick.write(0x01, b"\\x00\\x0b")
print(bytes(brick.read(0x82, 64)).hex())
print("second", subprocess.run(["t2n", "-b"]).returncode)
brick.write(0x01, b"\\x00\\x0b")
print(bytes(brick.read(0x82, 64)).hex())
"""
    first, second, third = execute(sys.executable, "-c", program).stdout.splitlines()
    assert first == third
    assert second == "second 1"
