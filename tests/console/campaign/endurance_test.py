# SPDX-License-Identifier: Apache-2.0
"""A short endurance.py run, and that it detects a failure."""
import os
import random
import signal
import subprocess
import sys
import unittest

from daemon_process import SIMRIG

SCRIPT = os.path.join(os.path.dirname(__file__), "endurance.py")
SHORT_H = "0.0125"  # of the rig's time: some 20 s of a processor


@unittest.skipUnless(SIMRIG, "the simulated rig needs -DVERGENCE_FPGA=ON")
class Endurance(unittest.TestCase):
    def test_three_quarters_of_a_minute(self):
        seed = os.environ.get("VERGENCE_TEST_SEED", str(random.randrange(1 << 32)))
        print(f"VERGENCE_TEST_SEED={seed}")
        done = subprocess.run([sys.executable, "-B", SCRIPT, "--hours", SHORT_H, "--seed", seed],
                              capture_output=True, text=True, timeout=550)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("nothing found", done.stdout)

    def started(self):
        """A run whose rig has been brought up."""
        run = subprocess.Popen([sys.executable, "-B", SCRIPT, "--verbose"], text=True,
                               stdout=subprocess.PIPE)
        while "bringup" not in (line := run.stdout.readline()):
            self.assertTrue(line, "it ended")
        return run

    def test_it_prints_its_progress(self):
        run = self.started()
        run.send_signal(signal.SIGINT)
        output_text = run.communicate(timeout=250)[0]
        self.assertEqual(run.returncode, 130, output_text)
        self.assertIn("of 24 virtual hours: interrupted", output_text)

    def test_a_daemon_that_ends_is_detected(self):
        run = self.started()
        with open(f"/proc/{run.pid}/task/{run.pid}/children", encoding="ascii") as file:
            children = [int(word) for word in file.read().split()]
        for child in children:
            with open(f"/proc/{child}/cmdline", "rb") as file:
                if b"backend=sim" in file.read():
                    os.kill(child, signal.SIGKILL)
        output_text = run.communicate(timeout=250)[0]
        self.assertEqual(run.returncode, 1, output_text)
        self.assertIn("FOUND", output_text)
        self.assertIn("ended with -9", output_text)


if __name__ == "__main__":
    unittest.main()
