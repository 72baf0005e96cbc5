"""Bind TCP ports of this computer."""

from __future__ import annotations

import socket

from firmware_protocol.errors import ConfigError, system_words

LOOPBACK = "127.0.0.1"
LAST_PORT = 0xFFFF


def listen(port: int, host: str = LOOPBACK) -> socket.socket:
    """Bind a port; 0 takes a free one.

    Raises:
        ConfigError: It is not available.
    """
    try:
        if not 0 <= port <= LAST_PORT:
            raise OSError(f"ports are numbered from 0 to {LAST_PORT}")
        return socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except OSError as error:
        reason = f"cannot listen on {host}:{port}: {system_words(error)}."
        raise ConfigError(reason, remedy="Choose another --port; 0 takes a free one.") from None
