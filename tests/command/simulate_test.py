# SPDX-License-Identifier: Apache-2.0
"""`vergence simulate` exists in every build; without the simulated rig it reports that in one line.
With the rig: tests/simrig/docs_test.py."""
import unittest

from pairs import run


class Simulate(unittest.TestCase):
    def test_help(self):
        done = run("simulate", "--help")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("vergence simulate chessboard --view pictures --zoom 3", done.stdout)

    def test_a_mistake_or_no_rig_is_one_line(self):
        done = run("simulate", "no/such/scene", "--view", "x")
        self.assertIn(done.returncode, (1, 3))
        self.assertEqual((done.stdout, done.stderr.count("\n")), ("", 1), done.stderr)
        if done.returncode == 1:
            self.assertIn("-DVERGENCE_FPGA=ON", done.stderr)


if __name__ == "__main__":
    unittest.main()
