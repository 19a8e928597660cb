# SPDX-License-Identifier: Apache-2.0
"""The board itself: QEMU's virtual ARM machine with Debian's U-Boot and a flash with its environment."""
import contextlib
import errno
import os
import pathlib
import shutil
import socket
import struct
import subprocess
import time

from network import MAC
from problem import Problem

U_BOOT = pathlib.Path("/usr/lib/u-boot/qemu_arm/u-boot.bin")
MEMORY_MB = 64
FLASH_BYTES = 64 << 20
ENVIRONMENT_BYTES = 0x40000
FIT_MAGIC = 0xD00DFEED
CONNECT_LIMIT_S = 30
# The partitions of the flash: U-Boot, its variables, two images, store.
PARTITIONS = "mtdparts=0.flash:64m(boot),256k(environment),4m(image),4m(image2),-(store)"
ENVIRONMENT = pathlib.Path(__file__).resolve().parents[2] / "firmware/system/environment.txt"
# U-Boot has these words at the end of its own start if no system began. They are put together from
# variables, so that a listing of the environment does not contain them.
REFUSED = b"board: no system started"
# A server that no longer answers is given up after some seconds, not minutes.
BENCH = """bootdelay=0
netretry=no
tftptimeout=1000
tftptimeoutcountmax=6
what=no system
bootcmd={bootcmd}; echo board: ${{what}} started
board_args={words}
"""


def check_programs():
    for name in ("qemu-system-arm", "mkenvimage"):
        if not shutil.which(name):
            raise Problem(f"{name} is not in PATH: tools/install_packages board")
    if not U_BOOT.exists():
        raise Problem(f"no U-Boot at {U_BOOT}: tools/install_packages board")


def check_image(folder):
    """Refuses a folder that U-Boot could not boot from; the sums are U-Boot's to check."""
    fit = folder / "vergence.fit"
    for path in (fit, folder / "boot.scr"):
        if not path.is_file():
            raise Problem(f"{path}: no such file (tools/image makes it)")
    with open(fit, "rb") as file:
        magic, length = struct.unpack(">II", file.read(8).ljust(8, b"\0"))
    if magic != FIT_MAGIC:
        raise Problem(f"{fit}: not a FIT image (tools/image makes one)")
    size = fit.stat().st_size
    if size < length:
        raise Problem(f"{fit}: cut off, {size} of {length} bytes (tools/image makes it again)")


def write_flash(path, words):
    """The second flash bank, which begins with U-Boot's environment. The rest is kept."""
    variables = ENVIRONMENT.read_text(encoding="utf-8").rsplit("bootcmd=", 1)
    text = variables[0] + BENCH.format(bootcmd=variables[1].strip(), words=" ".join([PARTITIONS, *words]))
    done = subprocess.run(["mkenvimage", "-s", str(ENVIRONMENT_BYTES), "-"], input=text.encode(),
                          capture_output=True, check=False)
    if done.returncode != 0:
        raise Problem(f"mkenvimage: {done.stderr.decode().strip()}")
    if not path.exists() or path.stat().st_size != FLASH_BYTES:
        path.write_bytes(b"\xff" * FLASH_BYTES)  # erased
    with open(path, "r+b") as file:
        file.write(done.stdout)


def start(network, folder, words, devices, running):
    """Starts QEMU; `devices` are its options for what the bench connects to the board."""
    write_flash(folder / "flash.img", words)
    (folder / "serial.sock").unlink(missing_ok=True)
    process = running.start([
        # Above 4 GB the kernel would not find the ports of a PCI device. The bench maps the memory.
        "qemu-system-arm", "-M", "virt,highmem=off,memory-backend=ram", "-object",
        f"memory-backend-memfd,id=ram,size={MEMORY_MB}M,share=on", "-m", MEMORY_MB, "-cpu", "cortex-a7",
        "-display", "none", "-nodefaults", "-bios", U_BOOT,
        "-drive", f"if=pflash,unit=1,format=raw,file={escaped(folder / 'flash.img')}",
        "-netdev", f"{network.netdev},id=net", "-device", f"virtio-net-device,netdev=net,mac={MAC}",
        "-chardev", f"socket,id=serial,path={escaped(folder / 'serial.sock')},server=on,wait=on",
        "-serial", "chardev:serial", *devices,
        # A second console, for a shell: the bench's own way in. It is the last serial port.
        "-chardev", f"socket,id=shell,path={escaped(folder / 'shell.sock')},server=on,wait=off",
        "-device", "pci-serial,chardev=shell"], folder / "qemu.log")
    running.wait((folder / "serial.sock").exists, "QEMU")
    return process


def escaped(path):
    """In QEMU's options a comma separates."""
    return str(path).replace(",", ",,")


@contextlib.contextmanager
def serial_of(folder, process):
    """The serial line, as a socket; the machine starts when it is opened."""
    with socket.socket(socket.AF_UNIX) as line:
        end = time.monotonic() + CONNECT_LIMIT_S
        while (number := line.connect_ex(str(folder / "serial.sock"))) != 0:
            # The socket's file is there before QEMU listens.
            if number != errno.ECONNREFUSED or process.poll() is not None or time.monotonic() > end:
                raise Problem(f"QEMU: {os.strerror(number).lower()} (exit code {process.poll()})")
            time.sleep(0.05)
        yield line
