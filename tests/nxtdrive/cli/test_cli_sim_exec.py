"""``nxtdrive sim exec``: Python programs find the simulated brick on USB; their end is the command's end."""

import json
import os
import signal
import subprocess
import sys

import pytest

ASK_BATTERY = """
import usb.core
brick = usb.core.find(idVendor=0x0694, idProduct=0x0002)
brick.write(0x01, b"\\x00\\x0b")
print(brick.serial_number, bytes(brick.read(0x82, 64)).hex())
"""


@pytest.fixture
def execute():
    """Runs ``sim exec`` on a program text of Python; returns the finished process."""

    def run(*words, program=("-c", ASK_BATTERY), env=None):
        command = [sys.executable, "-m", "nxtdrive", "sim", "exec", *words, "--", sys.executable, *program]
        return subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=60, stdin=subprocess.DEVNULL, env=env
        )

    return run


@pytest.mark.slow
def test_a_program_that_uses_only_pyusb_finds_the_brick(execute):
    done = execute()
    assert (done.returncode, done.stderr) == (0, "")
    serial_number, reply = done.stdout.split()
    assert serial_number == "001653010203"
    assert reply.startswith("020b00")


@pytest.mark.slow
@pytest.mark.parametrize(("options", "firmware"), [((), "1.29"), (("--firmware", "1.32"), "1.32")])
def test_our_own_driver_finds_it_with_the_firmware_that_was_chosen(execute, options, firmware):
    done = execute(*options, program=("-m", "nxtdrive", "info", "--nxt", "usb://", "--json"))
    assert json.loads(done.stdout)["firmware"] == firmware


@pytest.mark.slow
@pytest.mark.parametrize(
    ("end", "code"), [("sys.exit(7)", 7), ("os.kill(os.getpid(), signal.SIGKILL)", 128 + signal.SIGKILL)]
)
def test_the_exit_code_is_the_programs(execute, end, code):
    done = execute(program=("-c", f"import os, signal, sys; {end}"))
    assert done.returncode == code
    assert "sent nothing to the brick on USB. If it is no Python program with pyusb, add --native." in done.stderr


@pytest.mark.slow
def test_only_one_program_at_a_time_has_the_brick(execute):
    second = f"import subprocess, sys; sys.exit(subprocess.call([sys.executable, '-c', {ASK_BATTERY!r}]))"
    done = execute(program=("-c", f"{ASK_BATTERY}\n{second}"))
    assert "Resource busy" in done.stderr or "Errno 16" in done.stderr


@pytest.mark.slow
def test_programs_may_come_one_after_the_other(execute):
    again = "import subprocess, sys\nfor _ in range(3): subprocess.run([sys.executable, '-c', sys.argv[1]], check=True)"
    done = execute(program=("-c", again, ASK_BATTERY))
    assert done.stdout.count("020b00") == 3, done.stderr


@pytest.mark.slow
def test_a_program_may_read_and_write_in_different_threads(execute):
    program = """
import threading, usb.core
brick = usb.core.find(idVendor=0x0694)
brick.write(0x01, b"\\x00\\x0d"); brick.read(0x82, 64)
received = []
reader = threading.Thread(target=lambda: received.extend(bytes(brick.read(0x82, 64, 10_000))[1] for _ in range(50)))
reader.start()
for _ in range(50): brick.write(0x01, b"\\x00\\x0b")
reader.join()
print(received == [0x0B] * 50)
"""
    assert execute(program=("-c", program)).stdout == "True\n"


@pytest.mark.slow
def test_a_sitecustomize_of_the_users_own_still_runs(execute, tmp_path):
    (tmp_path / "sitecustomize.py").write_text("print('mine')")
    path = os.pathsep.join(filter(None, [str(tmp_path), os.environ.get("PYTHONPATH")]))
    done = execute(env={**os.environ, "PYTHONPATH": path})
    assert done.stdout.startswith("mine\n")
    assert "020b00" in done.stdout


@pytest.mark.slow
def test_pyusb_is_not_loaded_for_programs_that_do_not_use_it(execute):
    assert execute(program=("-c", "import sys; print('usb' in sys.modules)")).stdout == "False\n"


@pytest.mark.slow
def test_a_world_and_faults_can_be_chosen(execute, tmp_path):
    faults = tmp_path / "faults.toml"
    faults.write_text("drop_replies = [0]")
    done = execute("--world", "open", "--seed", "5", "--faults", str(faults))
    assert "timed out" in done.stderr


@pytest.mark.slow
def test_a_pulled_cable_is_a_missing_device(execute, tmp_path):
    faults = tmp_path / "faults.toml"
    faults.write_text("unplugged_ms = [[1, 1000000]]")
    done = execute("--faults", str(faults))
    assert "No such device" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_that_no_terminal_sent_reaches_the_program(number):
    program = f"""
import signal, sys
signal.pthread_sigmask(signal.SIG_BLOCK, [{number:d}])  # one that comes before sigwait stays pending
print("up", flush=True)
signal.sigwait([{number:d}])
sys.exit(5)
"""
    command = [sys.executable, "-m", "nxtdrive", "sim", "exec", "--", sys.executable, "-c", program]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True
    ) as execution:
        assert execution.stdout.readline() == "up\n"
        execution.send_signal(number)
        execution.communicate(timeout=30)
    assert execution.returncode == 5


@pytest.mark.parametrize("options", [[], ["--native"]])
def test_what_cannot_be_run_gives_one_sentence(options, refused):
    assert "no-such-program cannot be run" in refused("sim", "exec", *options, "--", "no-such-program")


def test_something_must_be_run(refused):
    assert "COMMAND" in refused("sim", "exec", "--")
