# SPDX-License-Identifier: Apache-2.0
"""What runs on the board once the image has started: seen by a root shell on a second serial port."""
import os
import pathlib
import shutil
import socket
import subprocess
import tempfile
import time
import unittest

from serial_line import SerialLine

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
BOOT = """setenv autoload no; dhcp
setenv board_args shell=ttyS0 mtdparts=0.flash:64m(boot),256k(environment),4m(image),4m(image2),-(rest)
tftpboot ${scriptaddr} boot.scr && source ${scriptaddr}
"""


class System(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        image = subprocess.run([ROOT / "tools" / "image"], capture_output=True, text=True, timeout=800,
                               check=True).stdout.strip()
        folder = tempfile.mkdtemp(prefix="vergence-system-")
        cls.addClassCleanup(shutil.rmtree, folder)
        cls.line = SerialLine(image, "-device", "pci-serial,chardev=shell", "-chardev",
                              f"socket,id=shell,path={folder}/shell,server=on,wait=off")
        cls.addClassCleanup(cls.line.close)
        cls.shell = socket.socket(socket.AF_UNIX)
        cls.addClassCleanup(cls.shell.close)
        cls.shell.connect(f"{folder}/shell")
        cls.shell.settimeout(60)
        cls.line.commands(BOOT)
        cls.line.wait("vergence> ")

    def run_on_board(self, command):
        """What the shell prints; the end is marked by a word that the typed line does not contain."""
        self.shell.sendall(f"{command}; echo the''end\n".encode())
        text = b""
        while b"theend" not in text:
            text += self.shell.recv(1 << 16)
        return text.decode().replace("\r", "").split("the''end\n")[-1].split("theend")[0]

    def test_the_daemon_is_not_root_and_its_log_is_the_kernel_s(self):
        processes = self.run_on_board("ps")
        self.assertRegex(processes, r"(?m)^ *\d+ vergence .* /bin/vergenced ")
        self.assertIn(": serving", self.run_on_board("dmesg"))

    def test_memory_is_bounded_and_most_of_it_is_free(self):
        figures = dict(line.split(":") for line in self.run_on_board("cat /proc/meminfo").splitlines())
        self.assertGreaterEqual(int(figures["MemAvailable"].split()[0]), 44_000)
        self.assertEqual(self.run_on_board("cat /proc/sys/vm/overcommit_memory").strip(), "2")
        self.assertRegex(self.run_on_board("df"), r"(?m)^files +24576 .* /var/lib/vergence/files$")

    def test_the_daemon_has_its_devices_and_no_others(self):
        listed = [line.split() for line in self.run_on_board("ls -l /dev").splitlines()]
        owned = {words[-1] for words in listed if "vergence" in words}
        self.assertLessEqual({"ttyAMA0", "watchdog", "kmsg", "mtd2", "mtd3"}, owned)
        self.assertEqual({"ttyS0", "mem", "console", "null", "mtd0", "mtd1", "mtd4"} & owned, set())

    def test_the_kernel_has_what_the_daemon_checks(self):
        report = self.run_on_board("vergenced --config /etc/vergence/vergenced.conf --check-board")
        rows = [line.split() for line in report.splitlines()]
        kernel = [row[0] for row in rows if row[1:2] == ["kernel"]]
        self.assertGreater(len(kernel), 10)
        self.assertEqual(set(kernel), {"there"}, report)

    def test_the_clock_is_right(self):
        self.assertAlmostEqual(int(self.run_on_board("date +%s")), time.time(), delta=120)

    def test_a_daemon_that_is_killed_starts_again(self):
        self.run_on_board("kill -9 $(pidof vergenced)")
        self.line.wait("serving")
        self.line.wait("vergence> ")
        self.line.type("status\r")
        self.line.wait("state: down")

    def test_the_network_has_an_address(self):
        self.assertIn("inet 192.0.2.", self.run_on_board("ip addr show eth0"))


if __name__ == "__main__":
    unittest.main()
