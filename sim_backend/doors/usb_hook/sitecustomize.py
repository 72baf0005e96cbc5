"""Put the simulated brick on the USB of any Python program that runs with this folder on PYTHONPATH.

``nxtdrive sim exec`` does that. Python imports `sitecustomize` at start; nothing is loaded here unless the program uses
pyusb, and only the standard library is needed until then.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import Any

HERE = Path(__file__).resolve().parent
LIBUSB = "usb.backend.libusb1"
VARIABLE = "NXTDRIVE_SIM_USB"
"""Address of the brick: ``host:port/serial number``."""


class _Finder(MetaPathFinder):
    """Finds pyusb's libusb module and patches it after loading."""

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        """Find that one module by the ordinary path finder."""
        spec = PathFinder.find_spec(fullname, path, target) if fullname == LIBUSB else None
        if spec is not None and spec.loader is not None:
            spec.loader = _Loader(spec.loader)
        return spec


class _Loader(Loader):
    """Loads with another loader, then replaces libusb's bus by ours."""

    def __init__(self, inner: Loader) -> None:
        self._inner = inner

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self._inner.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        self._inner.exec_module(module)
        backend = _bus(os.environ[VARIABLE])
        module.get_backend = lambda find_library=None: backend  # type: ignore[attr-defined] # noqa: ARG005 - pyusb's


def _bus(brick: str) -> object:
    """Return the bus with the brick at the address `brick`."""
    where, _, serial_number = brick.partition("/")
    host, _, port = where.rpartition(":")
    backend = _load("nxtdrive_usb_backend", HERE.parent / "usb_backend.py")
    cable = _load("nxtdrive_socket_cable", HERE.parent / "socket_cable.py")
    return backend.UsbBackend(lambda: cable.SocketCable(host, int(port)), serial_number)


def _load(name: str, path: Path) -> Any:  # noqa: ANN401 - a module like any other
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"cannot load {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def _run_hidden() -> None:
    """Run the `sitecustomize` that this one hides, if any."""
    elsewhere = [entry for entry in sys.path if Path(entry or ".").resolve() != HERE]
    spec = PathFinder.find_spec("sitecustomize", elsewhere)
    if spec is not None and spec.origin:
        _load("sitecustomize", Path(spec.origin))


if os.environ.get(VARIABLE):
    sys.meta_path.insert(0, _Finder())
_run_hidden()
