"""Start the guest, with hardware virtualisation where it works."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

from . import agent
from .errors import RigError
from .kernel import Kernel, cache

UP = "rig: guest up"
BOOT_S = {"kvm": 20.0, "tcg": 120.0}
"""Time limits. A host may have /dev/kvm and yet boot no stock kernel, so KVM is tried and not looked up."""

CPU = {"kvm": "host", "tcg": "max"}
APPEND = (
    "console=ttyS0 quiet panic=-1 nokaslr mitigations=off random.trust_cpu=on tsc=reliable no_timer_check net.ifnames=0"
    " rdinit=/init"
)


def command(kernel: Kernel, initrd: Path, accelerator: str, agent_port: int, doors: list[int]) -> list[str]:
    """Return the command line of QEMU. The guest reaches nothing but the `doors`, ports of this computer."""
    forwards = [f"guestfwd=tcp:{agent.HOST}:{port}-cmd:busybox nc 127.0.0.1 {port}" for port in doors]
    net = ["user", "id=n", "restrict=on", f"hostfwd=tcp:127.0.0.1:{agent_port}-:{agent.PORT}", *forwards]
    append = f"{APPEND} rig_python={sys.executable} rig_agent={agent.__file__}"
    accel = "tcg,thread=multi" if accelerator == "tcg" else accelerator
    return [
        *("qemu-system-x86_64", "-machine", "pc", "-accel", accel, "-cpu", CPU[accelerator], "-m", "1536", "-smp", "1"),
        *("-kernel", str(kernel.vmlinux), "-initrd", str(initrd), "-append", append),
        *("-display", "none", "-serial", "stdio", "-no-reboot", "-monitor", "none", "-nodefaults", "-no-user-config"),
        *("-device", "virtio-rng-pci"),
        *("-fsdev", "local,id=h,path=/,security_model=none,readonly=on,multidevs=remap"),
        *("-device", "virtio-9p-pci,fsdev=h,mount_tag=host"),
        *("-netdev", ",".join(net), "-device", "virtio-net-pci,netdev=n,romfile="),
    ]


def boot(kernel: Kernel, initrd: Path, agent_port: int, doors: list[int], log: Path) -> subprocess.Popen[bytes]:
    """Start the guest and wait until it can be talked to.

    Raises:
        RigError: It does not start.
    """
    for accelerator in _accelerators():
        with log.open("wb") as output:
            guest = subprocess.Popen(
                command(kernel, initrd, accelerator, agent_port, doors),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        if _is_up(guest, log, BOOT_S[accelerator]):
            (cache() / "accelerator").write_text(f"{_this_boot()} {accelerator}")
            return guest
        guest.kill()
        guest.wait()
    raise RigError(f"The guest did not start; {log} has its console:\n" + "\n".join(_console(log)[-5:]))


def _accelerators() -> list[str]:
    """Return the accelerators to try: KVM first, unless it failed since this computer was started."""
    remembered = cache() / "accelerator"
    if remembered.exists() and remembered.read_text() == f"{_this_boot()} tcg":
        return ["tcg"]
    return ["kvm", "tcg"] if Path("/dev/kvm").exists() else ["tcg"]


def _is_up(guest: subprocess.Popen[bytes], log: Path, limit_s: float) -> bool:
    until = time.monotonic() + limit_s
    while time.monotonic() < until and guest.poll() is None:
        if any(line.startswith(UP) for line in _console(log)):
            return True
        time.sleep(0.1)
    return False


def _console(log: Path) -> list[str]:
    return log.read_text(errors="replace").replace("\r", "").splitlines()


def _this_boot() -> str:
    return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
