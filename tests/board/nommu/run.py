# SPDX-License-Identifier: Apache-2.0
"""usage: run.py --kernel FILE --compiler FILE --programs DIR --host DIR [--keep DIR]

Boots the kernel without an MMU in QEMU with 64 MB of memory and vergenced as its only process, which
brings up a simulated rig of this machine, takes pairs of growing size and reconstructs them. The
disparities must be those that this machine computes of the same pair, byte for byte. Prints a table.
"""
import argparse
import contextlib
import gzip
import pathlib
import re
import secrets
import socket
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.dont_write_bytecode = True
sys.path.append(str(ROOT / "tools/system"))

from children import Children  # noqa: E402
from make_root import Archive, CONSOLE  # noqa: E402
from problem import Problem  # noqa: E402

MEMORY_MB = 64
BOOT_LIMIT_S, COMMAND_LIMIT_S = 300, 600
SIZES = ((160, 120), (320, 240), (640, 480))
# Both cameras look at the cylinder.
AIM = ("bringup", "pan 3.57 right=-3.272", "iris 800", "exposure 9000")
NEAR_MM, FAR_MM = 1600, 2300
FOLDERS = ("dev", "proc", "run", "tmp", "var/lib/vergence/files", "var/lib/vergence/store")
DAEMON = ("profile=rig", "store=/var/lib/vergence/store", "socket=/run/vergenced.sock",
          "files=/var/lib/vergence/files", "files_limit=24MB", "tcp_port=7878",
          "tcp_network=192.0.2.0/24", "tcp_token=/etc/token")


def run(*words, folder):
    """Standard output of a program of this machine, which must succeed."""
    done = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True,
                          timeout=COMMAND_LIMIT_S, check=False)
    if done.returncode != 0:
        raise Problem(f"{' '.join(map(str, words))}: {(done.stdout + done.stderr).strip()}")
    return done.stdout


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def write_root(arguments, folder, token):
    """The root file system: the daemon, its token, and the first process."""
    run(arguments.compiler, "-Wall", "-Wextra", "-Werror", "-O2", "-s", "-o", folder / "init",
        pathlib.Path(__file__).with_name("init.c"), folder=folder)
    archive = Archive(0)
    for name in FOLDERS:
        archive.add(name, 0o040755)
    archive.add("dev/console", 0o020600, device=CONSOLE)
    archive.add("etc/token", 0o100600, token.encode() + b"\n")
    archive.add_file("init", folder / "init")
    archive.add_file("bin/vergenced", arguments.programs / "vergenced")
    (folder / "root").write_bytes(gzip.compress(archive.bytes(), mtime=0))


class Machine:
    """The machine and the rig behind it, and the PC's client."""

    def __init__(self, arguments, folder, running):
        self.folder, self.host = folder, arguments.host
        token = secrets.token_hex(32)
        write_root(arguments, folder, token)
        (folder / "token").write_text(token + "\n")
        (folder / "token").chmod(0o600)
        rig, self.port = free_port(), free_port()
        self.rig = f"tcp:127.0.0.1:{rig}"
        log = folder / "rig.log"
        running.start([self.host / "tools/simrig/simrig", "--scene", "cylinder", "--seed", "3", "--listen",
                       f"tcp:{rig}", "--files", folder], log)
        running.wait(lambda: b"listening" in log.read_bytes(), "the simulated rig")
        # QEMU describes the processor in the old way, which an option has the kernel read: has it an FPU?
        words = ("console=ttyS0 quiet riscv_isa_fallback ip=192.0.2.15::192.0.2.2:255.255.255.0::eth0:off -- "
                 f"backend=\"sim tcp:192.0.2.2:{rig}\" " + " ".join(DAEMON))
        self.log = folder / "console.log"
        self.process = running.start([
            "qemu-system-riscv64", "-M", "virt", "-cpu", "rv64", "-m", MEMORY_MB, "-bios", "none",
            "-display", "none", "-nodefaults", "-serial", "stdio", "-no-reboot", "-kernel", arguments.kernel,
            "-initrd", folder / "root", "-append", words, "-netdev",
            f"user,id=net,net=192.0.2.0/24,hostfwd=tcp:127.0.0.1:{self.port}-:7878", "-device",
            "virtio-net-device,netdev=net"], self.log)

    def console(self):
        return self.log.read_text(encoding="utf-8", errors="replace")

    def client(self, *words):
        return run(self.host / "tools/vergence", "--connect", f"tcp:127.0.0.1:{self.port}", "--token",
                   self.folder / "token", *words, folder=self.folder)

    def wait(self):
        """Until the daemon answers."""
        end = time.monotonic() + BOOT_LIMIT_S
        while True:
            with contextlib.suppress(Problem, subprocess.TimeoutExpired):
                return self.client("status")
            if self.process.poll() is not None or time.monotonic() > end:
                raise Problem("the daemon does not answer")
            time.sleep(1)

    def calibrate(self, name):
        """The simulated rig knows its calibration, which depends on the window."""
        run(ROOT / "tools/simrig/control", self.rig, "truth left left", "truth right right",
            folder=self.folder)
        run(self.host / "tools/vergence", "info", ".", "--convert", name, folder=self.folder)
        self.client("send", name)
        self.client(f"calibration set {name}")
        (self.folder / name).unlink()

    def measure(self, width, height):
        """Captures and reconstructs one size; its row of the table."""
        name, size = f"scene{width}", f"{width}x{height}"
        self.client(f"window {width} {height}")
        self.client(f"capture first{width}")
        self.calibrate(f"rig{width}.calibration")
        self.client(f"capture {name}")
        begin = time.monotonic()
        self.client(f"reconstruct {name} near={NEAR_MM} far={FAR_MM} files=disparity.pfm")
        seconds = time.monotonic() - begin
        self.client("fetch", name)
        self.client("fetch", f"surface-{name}-1")
        run(self.host / "tools/vergence", "reconstruct", name, "--near", NEAR_MM, "--far", FAR_MM, "--out",
            f"host{width}", folder=self.folder)
        here, there = ((self.folder / place / "disparity.pfm").read_bytes()
                       for place in (f"host{width}", f"surface-{name}-1"))
        if here != there:
            raise Problem(f"{size}: the disparities are not those of this machine")
        return f"| {size} | {len(there)} bytes, the same as here | {seconds:.0f} s |"


def campaign(arguments, folder):
    with Children() as running:
        machine = Machine(arguments, folder, running)
        try:
            machine.wait()
            for line in AIM:
                machine.client(line)
            print("| size | disparities | time to reconstruct |\n|---|---|---|", flush=True)
            for size in SIZES:
                print(machine.measure(*size), flush=True)
        except (Problem, subprocess.TimeoutExpired):
            sys.stderr.write(machine.console())
            raise


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    for option in ("kernel", "compiler", "programs", "host"):
        parser.add_argument(f"--{option}", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="nommu-") as folder:
        try:
            campaign(arguments, pathlib.Path(folder))
        except (Problem, subprocess.TimeoutExpired) as error:
            sys.stderr.write(f"tools/campaign: {error}\n")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
