"""Debian's stock kernel, downloaded and unpacked once; nothing of it is changed."""

from __future__ import annotations

import contextlib
import fcntl
import lzma
import os
import re
import shutil
import subprocess
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from .errors import RigError

PACKAGES = {
    "qemu-system-x86_64": "qemu-system-x86",
    "busybox": "busybox-static",
    "cpio": "cpio",
    "depmod": "kmod",
    "pkill": "procps",
    "apt-get": "apt",
    "dpkg-deb": "dpkg",
}
"""Debian packages by the command that they bring."""

XZ_MAGIC = b"\xfd7zXZ\x00"
META_PACKAGE = "linux-image-amd64"
IMAGE = re.compile(r"^\s*Depends: (linux-image-[0-9][\w.+-]*-amd64)$", re.MULTILINE)
VERSION = re.compile(r"^Version: ([0-9.]+)", re.MULTILINE)

BROKEN_RFCOMM = ("6.1.192",)
"""Versions of Linux that a failed Bluetooth connection breaks: ``list_del corruption`` in krfcommd; programs that then
use RFCOMM hang in the kernel. 6.1.170 and 6.1.176 are sound."""


@dataclass(frozen=True)
class Kernel:
    """An unpacked kernel.

    Attributes:
        vmlinux: The uncompressed kernel: QEMU starts it at once, while unpacking takes emulation 5 s.
        modules: Folder with ``lib/modules``.
        version: Debian's release, such as ``6.1.0-56-amd64``.
        linux: Version of Linux, such as ``6.1.192``.
    """

    vmlinux: Path
    modules: Path
    version: str
    linux: str


def cache() -> Path:
    """Return the folder for files that take long to make: ``$XDG_CACHE_HOME/nxtdrive/rig``."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "nxtdrive" / "rig"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@contextlib.contextmanager
def locked() -> Iterator[None]:
    """Keep other processes from filling the cache at the same time."""
    with (cache() / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def missing() -> str | None:
    """Return what this computer lacks for the rig, one sentence with the command that installs it; None if nothing."""
    lacking = [package for command, package in PACKAGES.items() if which(command) is None]
    if not lacking:
        return None
    if {"apt", "dpkg"} & set(lacking):
        return "The rig needs Debian or Ubuntu on x86-64: it boots Debian's kernel."
    return f"The rig needs more packages: apt-get install --no-install-recommends {' '.join(lacking)}"


def which(command: str) -> str | None:
    """Return where a command is; None if this computer lacks it."""
    return shutil.which(command, path=_path())


def run(*command: str, cwd: Path | None = None) -> str:
    """Run a command to its end; returns its output.

    Raises:
        RigError: It failed; the message has its last lines.
    """
    environment = {**os.environ, "PATH": _path(), "LC_ALL": "C.UTF-8"}
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        last = "\n".join((done.stderr or done.stdout).splitlines()[-5:])
        raise RigError(f"{command[0]} failed ({' '.join(command)}):\n{last}")
    return done.stdout


def fetch(avoid: Collection[str] = ()) -> Kernel:
    """Download and unpack Debian's newest kernel of this release, unless the cache has it.

    Args:
        avoid: Versions of Linux not to take if there is another one of the same series.

    Raises:
        RigError: It cannot be downloaded or unpacked.
    """
    listing = run("apt-cache", "depends", META_PACKAGE)
    found = IMAGE.search(listing)
    if found is None:
        raise RigError(f"apt finds no kernel package ({META_PACKAGE}). Run apt-get update, then try again.")
    package, linux = found[1], _linux(found[1])
    if linux in avoid:
        series = re.escape(package.rsplit("-", 2)[0])
        names = run("apt-cache", "search", "--names-only", f"^{series}-[0-9]+-amd64$").splitlines()
        others = {
            name: version for name in (line.split()[0] for line in names) if (version := _linux(name)) not in avoid
        }
        package, linux = max(others.items(), key=lambda item: _numbers(item[1]), default=(package, linux))
    version = package.removeprefix("linux-image-")
    folder = cache() / version
    kernel = Kernel(folder / "vmlinux", folder / "root", version, linux)
    if not kernel.vmlinux.exists():
        shutil.rmtree(folder, ignore_errors=True)
        kernel.modules.mkdir(parents=True)
        run("apt-get", "download", "-q", package, cwd=folder)
        [archive] = folder.glob("*.deb")
        run("dpkg-deb", "-x", str(archive), str(kernel.modules))
        archive.unlink()
        run("depmod", "-b", str(kernel.modules), version)
        unpacked = _unpacked((kernel.modules / "boot" / f"vmlinuz-{version}").read_bytes())
        kernel.vmlinux.with_suffix(".part").write_bytes(unpacked)
        kernel.vmlinux.with_suffix(".part").rename(kernel.vmlinux)
    return kernel


def _linux(package: str) -> str:
    """Return the version of Linux in a package."""
    found = VERSION.search(run("apt-cache", "show", "--no-all-versions", package))
    return found[1] if found else ""


def _numbers(version: str) -> list[int]:
    return [int(part) for part in version.split(".") if part]


def _unpacked(vmlinuz: bytes) -> bytes:
    """Return the ELF file inside a compressed kernel: the xz stream that unpacks to one."""
    at = vmlinuz.find(XZ_MAGIC)
    while at >= 0:
        try:
            unpacked = lzma.LZMADecompressor().decompress(vmlinuz[at:])
        except lzma.LZMAError:
            unpacked = b""
        if unpacked.startswith(b"\x7fELF"):
            return unpacked
        at = vmlinuz.find(XZ_MAGIC, at + 1)
    raise RigError(
        "The kernel of this Debian release is not compressed with xz; the rig supports no other compression."
    )


def _path() -> str:
    """Return the search path with the folders of system commands, which an ordinary user's may lack."""
    return os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/sbin"])
