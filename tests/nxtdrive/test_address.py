"""Addresses: every text is either valid or clearly refused."""

import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.errors import AddressError, ConfigError
from nxtdrive import open_brick
from nxtdrive.transports import open_transport, transport_class
from nxtdrive.transports.address import Address

PRINTABLE = st.text("?%235Ff") | st.text(st.characters(min_codepoint=33, max_codepoint=0x2FF), max_size=20)


@given(st.text(max_size=60))
def test_any_text_is_an_address_or_an_address_error(text):
    try:
        address = Address.parse(text)
    except AddressError:
        return
    assert Address.parse(str(address)) == address


@pytest.mark.parametrize("text", ["usb", "USB", "usb:", "sim:/"])
def test_a_scheme_without_its_slashes_is_recognised(text):
    with pytest.raises(AddressError, match=f"Did you mean '{text[:3].lower()}://'"):
        Address.parse(text)


@given(
    st.from_regex(r"[a-z][a-z0-9+.-]{0,10}", fullmatch=True),
    PRINTABLE,
    st.dictionaries(st.text(min_size=1, max_size=8), st.text(max_size=8), max_size=3),
)
def test_an_address_survives_being_written_and_read(scheme, target, options):
    address = Address(scheme, target, options)
    assert Address.parse(str(address)) == address


@pytest.mark.parametrize(
    ("text", "scheme", "target"),
    [
        ("usb://0016530A1B2C", "usb", "0016530A1B2C"),
        ("USB://", "usb", ""),
        ("serial:///dev/rfcomm0", "serial", "/dev/rfcomm0"),
        ("serial://COM5", "serial", "COM5"),
        ("tcp://localhost:2727", "tcp", "localhost:2727"),
        ("COM5", "serial", "COM5"),
        ("/dev/rfcomm0", "serial", "/dev/rfcomm0"),
        ("/dev/tty.NXT-DevB", "serial", "/dev/tty.NXT-DevB"),
        ("00:16:53:0A:1B:2C", "bt", "00:16:53:0A:1B:2C"),
        ("0016530A1B2C", "usb", "0016530A1B2C"),
        ("localhost:2727", "tcp", "localhost:2727"),
        ("rooms/arena.toml", "sim", "rooms/arena.toml"),
    ],
)
def test_scheme_and_target(text, scheme, target):
    address = Address.parse(text)
    assert (address.scheme, address.target) == (scheme, target)


@pytest.mark.parametrize(
    ("target", "text"),
    [("what?.toml", "sim://what%3F.toml"), ("100%.toml", "sim://100%.toml"), ("a%20b%25", "sim://a%20b%2525")],
)
def test_a_question_mark_in_the_name_of_a_file_begins_no_options(target, text):
    assert str(Address("sim", target)) == text
    assert Address.parse(text) == Address("sim", target)


def test_the_name_of_a_file_in_an_option_may_be_any_bytes():
    name = os.fsdecode(b"caf\xe9.toml")
    assert Address.parse(str(Address("record", "x", {"nxt": f"sim://{name}"}))).options["nxt"] == f"sim://{name}"


def test_options_follow_the_question_mark():
    address = Address.parse("sim://arena.toml?seed=7&latency_ms=30&pace=realtime")
    assert address.target == "arena.toml"
    assert address.options == {"seed": "7", "latency_ms": "30", "pace": "realtime"}
    assert Address.parse("arena.toml?seed=7") == Address("sim", "arena.toml", {"seed": "7"})


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("nonsense", "usb://"),
        ("", "usb://"),
        ("my brick://1", "is not an address"),
        ("ubs://", "Did you mean 'usb://'"),
        ("http://brick", "serial://"),
        ("sim://?sede=7", "Did you mean 'seed'"),
        ("sim://?seed=seven", "seed=seven does not fit: it must be a whole number"),
        ("sim://?latency_ms=-1", "from 0"),
        ("sim://?latency_ms=nan", "from 0"),
        ("sim://?latency_ms=soon", "from 0"),
        ("sim://?pace=slow", "realtime"),
        ("sim://?firmware=1.31", "1.29 or 1.05 or 1.32"),
        ("sim://?seed=1&seed=2", "more than once"),
        ("usb://?seed=1", "unknown option"),
        ("record://\0?nxt=sim://", "is not an address"),
    ],
)
def test_a_mistake_is_named_with_its_remedy(text, says):
    with pytest.raises(AddressError, match=says):
        open_transport(text)


@pytest.mark.parametrize("address", [7, b"usb://", Path("arena.toml")])
def test_what_is_not_text_is_no_address(address):
    with pytest.raises(AddressError, match="is not an address: it must be text, as 'usb://' is"):
        open_brick(address)


def test_a_world_that_is_not_there_is_a_mistake_in_a_file():
    with pytest.raises(ConfigError):
        open_transport("sim://no-such-room.toml")


def test_without_an_address_the_environment_counts(monkeypatch):
    monkeypatch.setenv("NXT", "sim://open?seed=3")
    transport = open_transport()
    assert transport.address == "sim://open?seed=3"
    transport.close()


def test_other_packages_may_bring_transports(monkeypatch):
    class Plugin:
        name = "carrier-pigeon"

        def load(self):
            return "the class"

    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: [Plugin()])
    assert transport_class("carrier-pigeon") == "the class"


def test_a_transport_of_another_package_that_cannot_be_loaded_is_named(monkeypatch):
    broken = EntryPoint("carrier-pigeon", "no_such_package:Pigeon", "nxtdrive.transports")
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: [broken])
    with pytest.raises(AddressError, match=r"carrier-pigeon://.*no_such_package:Pigeon.*No module named"):
        transport_class("carrier-pigeon")


def test_a_transport_loads_only_what_it_needs():
    """Opening the simulator loads neither pyusb nor pyserial; parsing an address loads no transport at all."""
    code = (
        "import sys\n"
        "from nxtdrive.transports.address import Address\n"
        "Address.parse('usb://')\n"
        "print([name for name in sys.modules if name.split('.')[0] in ('usb', 'serial', 'sim_backend', 'numpy')])\n"
        "from nxtdrive import open_brick\n"
        "open_brick('sim://').close()\n"
        "print([name for name in sys.modules if name.split('.')[0] in ('usb', 'serial')])\n"
    )
    environment = {key: value for key, value in os.environ.items() if key != "NXT"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout.split() == ["[]", "[]"]
