# SPDX-License-Identifier: Apache-2.0
"""fpga/README.md, firmware/HARDWARE.md: commands run, files exist, pins match the pin file."""
import os
import re
import subprocess
import sys
import unittest

SOURCE = os.path.realpath(os.environ.get("VERGENCE_SOURCE")
                          or os.path.join(os.path.dirname(__file__), "..", ".."))
FPGA = os.path.join(SOURCE, "fpga")
with open(os.path.join(FPGA, "README.md"), encoding="utf-8") as readme:
    TEXT = readme.read()


class Readme(unittest.TestCase):
    def test_quick_commands_run(self):
        lines = [line for block in re.findall(r"^```sh\n(.*?)^```", TEXT, re.S | re.M)
                 for line in block.splitlines()]
        self.assertGreaterEqual(len(lines), 2)
        for line in lines:
            done = subprocess.run(["bash", "-c", line], cwd=SOURCE, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout}{done.stderr}")

    def test_commands_have_the_options_that_they_use(self):
        commands = re.findall(r"`python3 (fpga/tools/\w+\.py)([^`]*)`", TEXT)
        self.assertGreaterEqual(len(commands), 8)
        texts = {}
        for tool, options in commands:
            if tool not in texts:
                texts[tool] = subprocess.run(
                    [sys.executable, "-B", os.path.join(SOURCE, tool), "--help"], check=True,
                    capture_output=True, text=True).stdout
            for option in re.findall(r"--[\w-]+", options):
                self.assertIn(option, texts[tool], tool)

    def test_drawings_are_of_this_verilog(self):
        done = subprocess.run([sys.executable, "-B", os.path.join(FPGA, "tools", "waveforms.py"),
                               "--check"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_named_files_exist(self):
        links = [link.split("#")[0] for link in re.findall(r"\]\(([^)]+)\)", TEXT)]
        own = re.findall(r"`((?:rtl|boards|formal|sim|tools|generated)/[\w./*]+\w)`", TEXT)
        self.assertGreater(len(own), 20)
        for name in links + [name for name in own if "*" not in name]:
            self.assertTrue(os.path.exists(os.path.join(FPGA, name))
                            or os.path.exists(os.path.join(SOURCE, name)), name)

    def test_the_wiring_is_that_of_the_pin_file(self):
        with open(os.path.join(FPGA, "boards", "ice40_hx8k", "ice40_hx8k.pcf"),
                  encoding="utf-8") as file:
            built = {}
            for line in file:
                if header := re.match(r"# ---- (J\d)", line):
                    name = header[1]
                elif pin := re.match(r"set_io (?:-\S+ \w+ )?(\S+)\s+\w+\s+#.*?(\d+)\s*$", line):
                    built[pin[1]] = f"{name}-{pin[2]}"
        with open(os.path.join(SOURCE, "firmware", "HARDWARE.md"), encoding="utf-8") as file:
            reported = dict(re.findall(r"`([\w\[\]]+)` (J\d-\d+)", file.read()))
        self.assertGreater(len(built), 55)
        self.assertEqual(reported, built)


if __name__ == "__main__":
    unittest.main()
