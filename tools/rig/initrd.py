"""The guest's first file system: busybox, kernel modules, and a script that puts the host's root under an overlay."""

from __future__ import annotations

import gzip
import hashlib
import shutil
import subprocess
from pathlib import Path

from .kernel import Kernel, cache, run, which

MODULES = (
    *("virtio_pci", "virtio_net", "9p", "9pnet_virtio", "overlay"),
    *("vhci-hcd", "uvcvideo", "hci_vhci", "rfcomm", "bnep"),
)
"""In the order of loading: to reach the host, then what the devices need."""

HERE = Path(__file__).resolve().parent
INIT = HERE / "guest_init.sh"


def build(kernel: Kernel) -> Path:
    """Build the file system, unless the cache has it for this kernel and this script."""
    mark = hashlib.sha256(INIT.read_bytes() + " ".join(MODULES).encode()).hexdigest()[:12]
    made = cache() / f"initrd-{kernel.version}-{mark}.gz"
    if made.exists():
        return made
    folder = cache() / "initrd"
    shutil.rmtree(folder, ignore_errors=True)
    for name in ("bin", "modules", "proc", "sys", "dev", "new", "lower", "ram"):
        (folder / name).mkdir(parents=True)
    shutil.copy(str(which("busybox")), folder / "bin" / "busybox")
    shutil.copy(INIT, folder / "init")
    (folder / "init").chmod(0o755)
    order = []
    for path in _modules(kernel):
        shutil.copy(path, folder / "modules" / path.name)
        order.append(path.name)
    (folder / "modules.txt").write_text("\n".join(order) + "\n")
    names = "\n".join(sorted(str(path.relative_to(folder)) for path in folder.rglob("*")))
    archive = subprocess.run(
        ["cpio", "-o", "-H", "newc", "--quiet"],
        input=names.encode(),
        cwd=folder,
        capture_output=True,
        check=True,
    ).stdout
    made.with_suffix(".part").write_bytes(gzip.compress(archive, 1))
    made.with_suffix(".part").rename(made)
    shutil.rmtree(folder)
    return made


def _modules(kernel: Kernel) -> list[Path]:
    """Return the files of the modules and of all that they need, each once, in the order of loading."""
    found: dict[str, None] = {}
    for module in MODULES:
        shown = run("modprobe", "-d", str(kernel.modules), "-S", kernel.version, "--show-depends", module)
        for line in shown.splitlines():
            if line.startswith("insmod "):
                found[line.split()[1]] = None
    return [Path(path) for path in found]
