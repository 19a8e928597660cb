# SPDX-License-Identifier: Apache-2.0
"""The Python package's client of the daemon, in front of two webcams of a fake kernel."""
import os
import pathlib
import re
import signal
import socket
import tempfile
import unittest

import numpy

import package
from fake_devices import DeviceTest, texture

v = package.load()


class Connected(DeviceTest):
    def setUp(self):
        super().setUp()
        self.serve(self.cameras(), "profile=two-cameras")
        self.instrument = v.connect(f"unix:{self.path}")
        self.addCleanup(self.instrument.close)
        self.instrument.bringup()

    def test_a_captured_pair_is_fetched(self):
        pair = self.instrument.capture()
        for side, seed in (("left", 0), ("right", 1)):
            off = numpy.abs(getattr(pair, side).astype(int) - texture(seed).astype(int))
            self.assertLessEqual(numpy.median(off), 2)
        self.assertEqual(self.instrument("files").get("files", []), [])
        with self.assertRaisesRegex(v.Error, "calibration"):
            pair.reconstruct()
        path = pair.path
        del pair
        self.assertFalse(os.path.exists(path))

    def test_a_named_one_stays_there(self):
        with tempfile.TemporaryDirectory() as folder:
            pair = self.instrument.capture("scene", to=os.path.join(folder, "scene"))
            self.assertTrue(os.path.isfile(os.path.join(pair.path, "session.index")))
            index = self.instrument.fetch("scene/session.index")
            self.assertEqual(index, (pathlib.Path(pair.path) / "session.index").read_bytes())
            with self.assertRaisesRegex(v.Error, "not empty"):
                self.instrument.capture(to=folder)

    def test_pictures_as_they_are_now(self):
        pictures = self.instrument.stream(side_px=160)
        for _ in range(2):
            left, right = next(pictures)
            self.assertEqual((left.shape, right.shape), ((120, 160, 3),) * 2)
        self.assertEqual(self.instrument.look(160, colour=False).left.shape, (120, 160))

    def test_errors_are_those_of_the_console(self):
        line = self.first.ask("zoom 5x")[-1]
        with self.assertRaises(v.Error) as caught:
            self.instrument.zoom("5x")
        self.assertEqual(line, f"ERR {caught.exception.code} {caught.exception}")
        for command in ("nonsense", "status\nstatus", "x" * 9999):
            with self.assertRaises(v.Error):
                self.instrument(command)
        self.assertIn("state", str(self.instrument.status()))
        self.instrument.close()
        with self.assertRaisesRegex(v.Error, "closed"):
            self.instrument.status()

    def test_control_c_cancels_the_command(self):
        def interrupt(_what, _share):
            os.kill(os.getpid(), signal.SIGINT)
        with self.assertRaises(KeyboardInterrupt):
            self.instrument("wait 600", progress=interrupt)
        self.instrument("status")

    def test_control_c_between_an_answer_and_its_picture_leaves_the_next_answer_whole(self):
        receive, count = self.instrument._bytes, []

        def interrupted(size):
            count.append(size)
            if len(count) == 1:
                raise KeyboardInterrupt
            return receive(size)
        self.instrument._bytes = interrupted
        with self.assertRaises(KeyboardInterrupt):
            next(self.instrument.stream(side_px=160))
        self.assertIn("state", str(self.instrument.status()))

    def test_a_daemon_that_ends_is_an_error(self):
        self.end(type(self).daemon)
        for _ in range(2):
            with self.assertRaisesRegex(v.Error, "closed"):
                self.instrument.status()
        self.start()

    def test_the_readme(self):
        text = (package.SOURCE / "library/README.md").read_text()
        program = re.search(r"^```python instrument\n(.*?)^```", text, re.M | re.S)[1]
        exec(compile(program.replace("unix:v.sock", f"unix:{self.path}"), "README.md", "exec"), {"v": v})


class NotConnected(unittest.TestCase):
    def test_no_daemon_and_wrong_addresses(self):
        with tempfile.TemporaryDirectory() as folder:
            for address, text in ((f"unix:{folder}/v.sock", "No such file"), ("rig", "not an address"),
                                  ("tcp:127.0.0.1", "not an address"), ("tcp:127.0.0.1:99999", "not an address")):
                with self.assertRaisesRegex(v.Error, text):
                    v.connect(address)

    def test_a_missing_token_is_named(self):
        with socket.create_server(("127.0.0.1", 0)) as server:
            with self.assertRaisesRegex(v.Error, "/nowhere/token: No such file"):
                v.connect(f"tcp:127.0.0.1:{server.getsockname()[1]}", token="/nowhere/token")


if __name__ == "__main__":
    unittest.main()
