"""Transports to a brick, by address scheme.

A new transport is one file with one class (see `base.Transport`), one line in `SCHEMES`, and the cases of
``tests/contract/``. A separate package registers an entry point in the group ``nxtdrive.transports`` instead.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import Protocol, cast

from firmware_protocol.errors import AddressError
from nxtdrive.transports.address import DEFAULT, Address, unknown_scheme
from nxtdrive.transports.base import Transport

SCHEMES: dict[str, tuple[str, str]] = {
    "usb": ("nxtdrive.transports.usb_port", "UsbTransport"),
    "bt": ("nxtdrive.transports.bluetooth", "BluetoothTransport"),
    "serial": ("nxtdrive.transports.serial_port", "SerialTransport"),
    "tcp": ("nxtdrive.transports.tcp", "TcpTransport"),
    "nxt-server": ("nxtdrive.transports.nxt_server", "NxtServerTransport"),
    "sim": ("nxtdrive.transports.sim", "SimTransport"),
    "record": ("nxtdrive.transports.record", "RecordTransport"),
    "replay": ("nxtdrive.transports.replay", "ReplayTransport"),
}
"""Scheme to module and class; the module is imported when the scheme is used."""

ENTRY_POINTS = "nxtdrive.transports"


class TransportClass(Protocol):
    """The interface of the class behind a scheme."""

    def open(self, address: Address, timeout_s: float) -> Transport:
        """Open `address` within about `timeout_s`."""
        ...


def open_transport(address: str | Address | None = None, *, timeout_s: float = 1.0) -> Transport:
    """Open a link to a brick.

    Args:
        address: See `nxtdrive.transports.address`; None means ``$NXT``, and without that the first brick on USB.
        timeout_s: Longest time for connecting, where the transport can limit it.

    Raises:
        AddressError: No transport can open this address; the message lists what can be opened.
        BrickNotFound: There is no brick.
        LinkError: There is a brick, but it cannot be reached.
    """
    if address is None:
        address = os.environ.get("NXT") or DEFAULT
    if not isinstance(address, Address):
        address = Address.parse(address)
    return transport_class(address.scheme).open(address, timeout_s)


def reopen_transport(transport: Transport, *, timeout_s: float = 1.0) -> Transport:
    """Close a lost link and open another to the same brick; errors as for `open_transport`.

    A transport that needs more than the address to do so has a method `reopen`: the simulator keeps its world.
    """
    transport.close()
    reopen = getattr(transport, "reopen", None)
    if reopen is not None:
        return cast("Transport", reopen(timeout_s))
    return open_transport(transport.address, timeout_s=timeout_s)


def transport_class(scheme: str) -> TransportClass:
    """Return the class that serves `scheme`, from the table or from other packages' entry points.

    Raises:
        AddressError: There is none, or that of another package cannot be loaded.
    """
    if scheme in SCHEMES:
        module, name = SCHEMES[scheme]
        return cast("TransportClass", getattr(import_module(module), name))
    from importlib.metadata import entry_points

    plugins = {plugin.name: plugin for plugin in entry_points(group=ENTRY_POINTS)}
    if scheme not in plugins:
        raise unknown_scheme(scheme, [*SCHEMES, *plugins])
    plugin = plugins[scheme]
    try:
        return cast("TransportClass", plugin.load())
    except Exception as error:  # the module of another package may raise anything
        raise AddressError(
            f"the transport for {scheme}:// addresses ({plugin.value}) cannot be loaded: "
            f"{type(error).__name__}: {error}.",
            remedy="Correct or uninstall the package that offers it.",
        ) from error
