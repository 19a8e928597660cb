# SPDX-License-Identifier: Apache-2.0
"""Shared by the image's tests: a person at the serial line of the board in QEMU."""
import os
import re
import select
import subprocess
import time

LIMIT_S = 150
MACHINE = ("qemu-system-arm", "-M", "virt,highmem=off", "-cpu", "cortex-a7", "-m", "64", "-nographic",
           "-no-reboot", "-bios", "/usr/lib/u-boot/qemu_arm/u-boot.bin", "-nic", "none",
           "-device", "virtio-net-device,netdev=net", "-netdev")


class SerialLine:
    """The board in QEMU, at U-Boot's prompt. U-Boot finds the files of `folder` by TFTP."""

    def __init__(self, folder):
        self.text, self.seen = "", 0
        self.process = subprocess.Popen(
            [*MACHINE, f"user,id=net,net=192.0.2.0/24,tftp={folder}"], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.wait("Hit any key")
        self.type(" ")
        self.wait("=> $")

    def commands(self, text):
        """Types lines to U-Boot; does not wait for the end of the last one."""
        *lines, last = text.splitlines()
        for line in lines:
            self.type(line + "\r")
            self.wait("=> $")
        self.type(last + "\r")

    def wait(self, pattern):
        """Reads up to this, from where the last wait ended."""
        end = time.monotonic() + LIMIT_S
        while not (found := re.search(pattern, self.text[self.seen:])):
            ready = select.select([self.process.stdout], [], [], max(0, end - time.monotonic()))[0]
            data = os.read(self.process.stdout.fileno(), 1 << 16) if ready else b""
            self.text += data.decode(errors="replace")
            if not data:
                raise AssertionError(f"no {pattern!r} at the serial line:\n{self.text}")
        self.seen += found.end()

    def type(self, text):
        self.process.stdin.write(text.encode())
        self.process.stdin.flush()

    def close(self):
        self.process.kill()
        self.process.communicate()
