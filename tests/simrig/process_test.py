# SPDX-License-Identifier: Apache-2.0
"""The real process: its time, who may use it, and the ways to it. What goes over its buses and lines:
tests/rig, and rig_test.cpp."""
import os
import select
import stat
import struct
import time
import unittest

from simrig_client import (BAD_REQUEST, BOARD, BRIDGE, CONTROLLER, FAILED, NO_FRAME_ARMED, NOT_ALLOWED, OK,
                           Bench, GPIO_SET, Gone, WAKE_GPIO, Refused)
from waiting import wait_until


class VirtualTime(Bench):
    def setUp(self):
        super().setUp()
        self.running = self.start()
        self.board = self.running.client()

    def test_time_passes_by_requests_alone(self):
        begin = self.board.time_us()
        time.sleep(0.05)
        self.assertEqual(self.board.time_us(), begin)
        now, woken = self.board.advance(30000)
        self.assertEqual((now, woken), (begin + 30000, 0))
        # A transfer takes as long as its bits: START, 4 bytes of 9, STOP at 100 kHz.
        before = self.board.time_us()
        self.assertEqual(self.board.transfer([(BRIDGE, b"\x04\x12\x34")], 100000)[0], OK)
        self.assertIn(self.board.time_us() - before, range(360, 400))
        # The past is over at once.
        self.assertEqual(self.board.advance(-1000)[1], 0)

    def test_roles(self):
        control = self.running.client(CONTROLLER)
        self.assert_rejection(NOT_ALLOWED, control.read, BRIDGE, 0)
        self.assert_rejection(NOT_ALLOWED, control.arm, 4, 4)
        self.assertIn("time_s:", control.control("status"))
        self.assertEqual(control.advance(1000)[0], self.board.time_us())
        self.assertIn("time_s:", self.board.control("status"))
        # After the board disconnects another client may be the board, and its lines are released.
        self.board.arm(4, 4)
        self.board.ask(GPIO_SET, struct.pack("<I", 1))
        self.board.close()

        def seated():
            try:
                return self.running.client(BOARD)
            except Refused:
                return None
        self.board = wait_until(seated)
        self.assert_rejection(NO_FRAME_ARMED, self.board.frame)
        self.board.advance(200)
        self.assertEqual(self.board.read(BRIDGE, 0), 0x5B1D)


class Rubbish(Bench):
    def test_another_protocol(self):
        running = self.start()
        for sent in (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", b"\xff" * 4096):
            client = running.client(greet=False)
            client.socket.sendall(sent)
            _, _, status, text = client.receive()
            self.assertEqual(status, BAD_REQUEST)
            self.assertIn(b"16777216", text)
            self.assertRaises(Gone, client.exactly, 1)
        self.assertGreaterEqual(running.client(CONTROLLER).time_us(), 0)

    def test_bad_commands(self):
        client = self.start().client(CONTROLLER)
        for line in ("", "dance", "scene /dev/zero", "truth up x", "fault servo left", "at 5 status",
                     "at 1e9 fault bus ok", "fault camera left torn 10", "fault serial garbage 1.5",
                     "move cat 1 2 3", "move board 1 2 nan", "move board 1 2 3 4", "restore x",
                     "snapshot a b", "fault bus ok extra", "scene \x1b[2J\n"):
            text = self.assert_rejection(FAILED, client.control, line)
            self.assertTrue(text and "\x1b" not in text, line)
        self.assertIn("time_s", client.control("status"))


class EveryClock(Bench):
    """What the bridge measures of cameras without an armed frame."""

    def measured(self, *arguments):
        board = self.start(*arguments).client()
        board.bring_up()
        # Frames seen, lines, pixels, period, pixel clock: words 30 to 34 of the left camera.
        before = board.read(BRIDGE, 0x30)
        board.advance(10000)
        frames, lines, pixels, period_10us, clock_khz = board.read(BRIDGE, 0x30, 5)
        return frames - before, lines, pixels, period_10us, clock_khz

    def test_the_bridge_counts_all_frames(self):
        frames, lines, pixels, period_10us, clock_khz = self.measured("--every-clock")
        # 48 rows and 6 of blank, 511 clocks each.
        period_us = 54 * 511 / 48
        self.assertEqual((lines, pixels), (48, 64))
        self.assertIn(frames, range(int(10000 / period_us) - 1, int(10000 / period_us) + 3))
        self.assertAlmostEqual(period_10us * 10, period_us, delta=0.02 * period_us + 10)
        self.assertAlmostEqual(clock_khz, 48000, delta=500)


class WallTime(Bench):
    def test_time_is_the_clock_s(self):
        board = self.start("--wall").client()
        self.assertEqual(struct.unpack_from("<HH", board.greeting), (1, 1))
        begin, clock = board.time_us(), time.monotonic()
        time.sleep(0.3)
        passed = board.time_us() - begin
        self.assertIn(passed, range(200000, int((time.monotonic() - clock) * 1e6) + 50000))
        clock = time.monotonic()
        board.advance(200000)
        self.assertGreater(time.monotonic() - clock, 0.15)

    def test_edges_wake_as_in_virtual_time(self):
        board = self.start("--wall").client()
        board.advance(2000)
        for index, value in ((0x0B, 1 << 4), (0x0E, 30), (0x08, 1)):
            self.assertEqual(board.write(BRIDGE, index, value), OK)
        self.assertEqual(board.advance(5000000, WAKE_GPIO)[1], WAKE_GPIO)
        self.assertEqual(board.gpio()[1][-1][2], 1)

    def test_the_lens_controller_as_a_terminal(self):
        running = self.start("--wall", "--pty")
        name = running.lines[0].rpartition(" ")[2]
        self.assertTrue(name.startswith("/dev/"), running.lines)
        line = os.open(name, os.O_RDWR | os.O_NOCTTY)
        try:
            os.write(line, b"2?\n")
            answer = b""
            while not answer.endswith(b"\r\n"):
                self.assertTrue(select.select([line], [], [], 30)[0], answer)
                answer += os.read(line, 100)
        finally:
            os.close(line)
        self.assertRegex(answer.decode(), r"^V3LC 2\rZoom:0\d{3}\rFocus:0\d{3}\rIris:0\d{3}\r\n$")
        self.assertEqual(running.stop(), 0)

    def test_nothing_of_virtual_time(self):
        control = self.start("--wall").client(CONTROLLER)
        with self.assertRaises(Refused) as caught:
            control.control("snapshot a")
        self.assertIn("virtual time", caught.exception.text)


class Listening(Bench):
    def refuse(self, where):
        self.assert_refused(self.run_simrig("--scene", self.scene, "--listen", where), 1, "in use")

    def test_in_use(self):
        first = self.start(where="tcp:0")
        port = first.where.rpartition(":")[2]
        self.refuse(f"tcp:{port}")
        path = self.folder / "s.sock"
        second = self.start(where=f"unix:{path}")
        self.assertEqual(stat.S_IMODE(path.stat().st_mode) & 0o077, 0, "open to others")
        self.refuse(f"unix:{path}")
        self.assertTrue(second.client().time_us() >= 0)
        # A killed process leaves its socket, which is replaced.
        second.process.kill()
        second.process.wait()
        self.assertTrue(path.exists())
        third = self.start(where=f"unix:{path}")
        self.assertEqual(third.stop(), 0)
        self.assertFalse(path.exists())


if __name__ == "__main__":
    unittest.main()
