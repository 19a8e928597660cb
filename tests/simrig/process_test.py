# SPDX-License-Identifier: Apache-2.0
"""The real process: its time, who may use it, and the ways to it. What goes over its buses and lines:
tests/rig, and rig_test.cpp."""
import os
import select
import struct
import time
import unittest

from simrig_client import (BOARD, BRIDGE, CONTROLLER, NO_FRAME_ARMED, NOT_ALLOWED, OK, Bench, GPIO_SET,
                           WAKE_GPIO, Refused)
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


class Tcp(Bench):
    def test_any_free_port(self):
        running = self.start(where="tcp:0")
        self.assertRegex(running.where, r"^tcp:127\.0\.0\.1:\d+$")
        self.assertEqual(running.client().advance(1000)[1], 0)
        self.assertEqual(running.stop(), 0)


if __name__ == "__main__":
    unittest.main()
