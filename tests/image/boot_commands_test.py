# SPDX-License-Identifier: Apache-2.0
"""The commands for U-Boot in firmware/image/README.md, typed at U-Boot's prompt in QEMU: both formats of
the image start, up to the instrument's prompt."""
import os
import pathlib
import re
import select
import subprocess
import time
import unittest

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
LIMIT_S = 150
MACHINE = ("qemu-system-arm", "-M", "virt,highmem=off", "-cpu", "cortex-a7", "-m", "64", "-nographic",
           "-no-reboot", "-bios", "/usr/lib/u-boot/qemu_arm/u-boot.bin", "-nic", "none",
           "-device", "virtio-net-device,netdev=net", "-netdev")


class SerialLine:
    def __init__(self, folder):
        self.text = ""
        self.process = subprocess.Popen(
            [*MACHINE, f"user,id=net,net=192.0.2.0/24,tftp={folder}"], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def wait(self, pattern):
        """Reads up to this, and forgets what was before."""
        end = time.monotonic() + LIMIT_S
        said = ""
        while not re.search(pattern, said):
            ready = select.select([self.process.stdout], [], [], max(0, end - time.monotonic()))[0]
            data = os.read(self.process.stdout.fileno(), 1 << 16) if ready else b""
            self.text += data.decode(errors="replace")
            said += data.decode(errors="replace")
            if not data:
                raise AssertionError(f"no {pattern!r} at the serial line:\n{self.text}")

    def type(self, text):
        self.process.stdin.write(text.encode())
        self.process.stdin.flush()

    def close(self):
        self.process.kill()
        self.process.communicate()


class BootCommands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        done = subprocess.run([ROOT / "tools" / "image"], capture_output=True, text=True, timeout=800,
                              check=True)
        cls.folder = done.stdout.strip()
        readme = (ROOT / "firmware" / "image" / "README.md").read_text()
        cls.blocks = re.findall(r"^```u-boot\n(.*?)^```", readme, re.M | re.S)

    def start(self, block):
        line = SerialLine(self.folder)
        self.addCleanup(line.close)
        line.wait("Hit any key")
        line.type(" ")
        line.wait("=> $")
        *commands, last = block.splitlines()
        for command in commands:
            line.type(command + "\r")
            line.wait("=> $")
        line.type(last + "\r")
        line.wait("vergence> ")
        line.type("status\r")
        line.wait("state: down")
        return line.text

    def test_the_script_and_the_image(self):
        self.assertEqual(len(self.blocks), 2)
        text = self.start(self.blocks[0])
        self.assertEqual(text.count("sha256+ OK"), 2, text)

    def test_the_old_format(self):
        text = self.start(self.blocks[1])
        self.assertEqual(text.count("Verifying Checksum ... OK"), 2, text)


if __name__ == "__main__":
    unittest.main()
