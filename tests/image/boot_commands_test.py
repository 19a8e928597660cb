# SPDX-License-Identifier: Apache-2.0
"""The commands for U-Boot in firmware/system/README.md, typed at U-Boot's prompt in QEMU: both formats of
the image start, up to the instrument's prompt."""
import os
import pathlib
import re
import subprocess
import unittest

from serial_line import SerialLine

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])


class BootCommands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        done = subprocess.run([ROOT / "tools" / "image"], capture_output=True, text=True, timeout=800,
                              check=True)
        cls.folder = done.stdout.strip()
        readme = (ROOT / "firmware" / "system" / "README.md").read_text()
        cls.blocks = re.findall(r"^```u-boot\n(.*?)^```", readme, re.M | re.S)

    def start(self, block):
        line = SerialLine(self.folder)
        self.addCleanup(line.close)
        line.commands(block)
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
