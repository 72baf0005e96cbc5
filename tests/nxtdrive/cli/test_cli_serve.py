"""``nxtdrive serve``, as a user runs it."""

from __future__ import annotations

import errno
import os
import re
import signal
import socket

import pytest

from nxtdrive.cli.main import main
from nxtdrive.host.listening import listen


@pytest.fixture
def server(started):
    """Starts servers in processes of their own; gives the process and its address."""

    def start(*arguments):
        process = started("serve", "--port", "0", *arguments)
        host, port = re.fullmatch(r"serving (.+):(\d+)\n", process.stdout.readline()).groups()
        return process, (host, int(port))

    return start


def _ask(client, replies, line):
    client.sendall(line.encode() + b"\n")
    return int(replies.readline())


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.nightly)])
def test_a_signal_ends_it_in_good_order_in_the_midst_of_a_command(server, number):
    process, address = server("--nxt", "sim://open")
    assert address[0] == "127.0.0.1"
    with socket.create_connection(address, timeout=60) as client, client.makefile("rb") as replies:
        assert _ask(client, replies, "connect") == 1
        assert _ask(client, replies, "help") == -1
        # with the first answer the second command begins
        client.sendall(b"move_to 90\nmove_to 90\n")
        assert int(replies.readline()) == 0
        process.send_signal(number)
        assert replies.read() in (b"1\n", b""), "broken off, or not even begun"
    said, errors = process.communicate(timeout=60)
    assert process.returncode == 0
    assert "connect -> 1" in said
    assert "'help' -> -1  unknown_verb" in said
    assert said.endswith("ended; motors off\n")
    assert errors == ""


@pytest.mark.slow
def test_the_first_line_names_brick_camera_and_targets(server):
    process, _ = server("--nxt", "sim://open")
    assert process.stdout.readline() == "brick sim://open?pace=realtime, camera sim, targets lena, rilakkuma\n"


@pytest.mark.slow
def test_a_simulated_robot_stands_in_the_room_of_the_mission(server, tmp_path):
    mission = tmp_path / "my.toml"
    assert main(["mission", "new", str(mission)]) == 0
    process, _ = server(str(mission))
    assert f"brick sim://{tmp_path}/my-world.toml?pace=realtime," in process.stdout.readline()


@pytest.mark.slow
def test_a_conversation_with_the_brick_can_be_recorded(server, tmp_path):
    process, address = server("--nxt", "sim://open", "--trace", str(tmp_path / "talk.nxttrace"))
    with socket.create_connection(address, timeout=60) as client, client.makefile("rb") as replies:
        assert _ask(client, replies, "connect") == 1
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    assert process.returncode == 0
    assert (tmp_path / "talk.nxttrace").stat().st_size > 0


@pytest.mark.slow
def test_listening_on_all_interfaces_prints_a_warning(server):
    process, address = server("--nxt", "sim://open", "--host", "0.0.0.0")
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=60)
    assert address[0] == "0.0.0.0"
    assert "anyone who can reach 0.0.0.0 can drive this robot" in errors


@pytest.mark.slow
def test_a_camera_that_refuses_is_one_sentence_and_nothing_from_ffmpeg(started):
    with socket.create_server(("127.0.0.1", 0)) as closed:
        url = f"http://127.0.0.1:{closed.getsockname()[1]}/camera.mjpg"
    ended = started("serve", "--port", "0", "--nxt", "sim://open", "--camera", url)
    said, errors = ended.communicate(timeout=60)
    assert (ended.returncode, said) == (2, "")
    assert errors.startswith(f"nxtdrive: the stream {url} gives no frames.")
    assert errors.count("\n") == 1


def test_it_listens_on_an_address_of_ipv6():
    try:
        socket.create_server(("::1", 0), family=socket.AF_INET6).close()
    except OSError:
        pytest.skip("this computer has no IPv6")
    with listen(0, "::1") as listener, socket.create_connection(listener.getsockname()[:2]):
        pass


def test_a_port_that_is_taken_is_one_sentence(capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["serve", "--nxt", "sim://open", "--port", str(port)]) == 2
    errors = capsys.readouterr().err
    assert f"cannot listen on 127.0.0.1:{port}: {os.strerror(errno.EADDRINUSE)}. Choose" in errors
    assert "--port" in errors


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (["nowhere.toml"], 2, "nowhere.toml: cannot be read"),
        (["--nxt", "sim://nowhere"], 2, "nowhere"),
        (["--nxt", "sim://?sede=7"], 2, "sede"),
        (["--nxt", "tcp://127.0.0.1:9", "--camera", "sim"], 3, "127.0.0.1"),
    ],
)
def test_bad_input_is_one_sentence(capsys, arguments, code, sentence):
    assert main(["serve", *arguments]) == code
    errors = capsys.readouterr().err
    assert sentence in errors
    assert "Traceback" not in errors
