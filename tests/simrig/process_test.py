# SPDX-License-Identifier: Apache-2.0
"""The real process over its socket: buses, lines, frames, bytes, time."""
import os
import select
import socket
import struct
import time
import unittest

from simrig_client import (BOARD, BRIDGE, CONTROLLER, DEADLINE, LEFT, NACK_ADDRESS, NO_FRAME_ARMED,
                           NOT_ALLOWED, OK, RIGHT, Bench, FRAME_CANCEL, FRAME_WAIT, GPIO_SET,
                           SERIAL_READ, SERIAL_WRITE, TRUTH, WAKE_FRAME, WAKE_GPIO,
                           WAKE_SERIAL, Refused)
from waiting import wait_until


class VirtualTime(Bench):
    def setUp(self):
        super().setUp()
        self.running = self.start()
        self.board = self.running.client()

    def test_greeting(self):
        version, wall = struct.unpack_from("<HH", self.board.greeting)
        self.assertEqual((version, wall, self.board.greeting[4:]), (1, 0, b"default"))

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

    def test_i2c_to_the_bridge_and_both_sensors(self):
        board = self.board
        board.advance(200)
        self.assertEqual(board.read(BRIDGE, 0x00), 0x5B1D)
        self.assertEqual(board.transfer([(0x11, b"\0")])[:3], (NACK_ADDRESS, 0, 0))
        self.assertEqual(board.write(BRIDGE, 0x48, 0x00F3), OK)
        self.assertEqual([board.read(s, 0x00) for s in (LEFT, RIGHT)], [0x1621, 0x1621])
        self.assertEqual(board.write(LEFT, 0x03, 99), OK)
        self.assertEqual([board.read(s, 0x03) for s in (LEFT, RIGHT)], [99, 1535])
        # A byte that is not acknowledged is reported with its position: a read-only ID.
        status, whole, some, _ = board.transfer([(BRIDGE, b"\x04"), (BRIDGE, b"\x00\x12\x34")])
        self.assertNotEqual(status, OK)
        self.assertEqual((whole, some), (1, 2))

    def test_reset_line(self):
        board = self.board
        board.advance(200)
        self.assertEqual(board.write(BRIDGE, 0x04, 0x1234), OK)
        board.ask(GPIO_SET, struct.pack("<I", 1))
        board.advance(20)
        self.assertEqual(board.transfer([(BRIDGE, b"\x04")])[0], NACK_ADDRESS)
        board.ask(GPIO_SET, struct.pack("<I", 0))
        board.advance(200)
        self.assertEqual(board.read(BRIDGE, 0x04), 0)

    def test_gpio_edges(self):
        board = self.board
        board.advance(200)
        board.gpio()
        self.assertEqual(board.write(BRIDGE, 0x0B, 1), OK)  # interrupt enable
        before = board.time_us()
        self.assertEqual(board.write(BRIDGE, 0x0C, 1), OK)  # interrupt test
        # The edge came during the transfer: a wait for one returns at once.
        self.assertEqual(board.advance(50000, WAKE_GPIO)[1], WAKE_GPIO)
        levels, edges = board.gpio()
        self.assertEqual((levels, len(edges)), (1, 1))
        self.assertIn(edges[0][0], range(before, board.time_us() + 1))
        self.assertEqual(edges[0][1:], (0, 1))
        self.assertEqual(board.advance(500, WAKE_GPIO)[1], 0)
        self.assertEqual(board.write(BRIDGE, 0x0A, 1), OK)  # clear
        self.assertEqual(board.gpio()[0], 0)
        # With the watchdog's interrupt the edge comes in the middle of an advance.
        for index, value in ((0x0A, 0xFF), (0x0B, 1 << 4), (0x0E, 20), (0x08, 1)):
            self.assertEqual(board.write(BRIDGE, index, value), OK)
        board.gpio()
        begin = board.time_us()
        now, woken = board.advance(100000, WAKE_GPIO)
        self.assertEqual(woken, WAKE_GPIO)
        self.assertIn(now - begin, range(19000, 23000))
        self.assertEqual(board.gpio()[1][0][2], 1)

    def test_frames_of_the_pattern_are_what_it_states(self):
        board = self.board
        board.advance(200)
        for index, value in ((0x24, 32), (0x25, 16), (0x28, 0), (0x20, 2), (0x08, 0x0100)):
            self.assertEqual(board.write(BRIDGE, index, value), OK)
        board.advance(5000)
        board.arm(32, 16)
        frame = board.frame()
        self.assertEqual(frame[3:6], (32, 16, 0))
        pixels = struct.unpack("<512H", frame[6])
        first = pixels[0]
        self.assertEqual(pixels, tuple((first + 33 * row + column) & 0x3FF
                                       for row in range(16) for column in range(32)))

    def test_frames_of_both_cameras(self):
        board = self.board
        board.bring_up()
        seen = {}
        for source in (0, 1, 0):
            self.assertEqual(board.write(BRIDGE, 0x20, source), OK)
            board.advance(12000)
            board.arm(64, 48)
            begin, end, _, _, _, faults, pixels = board.frame()
            self.assertEqual(faults, 0)
            self.assertGreater(end, begin)
            self.assertNotIn(pixels, seen.values(), "two frames with the same noise")
            seen[source] = pixels
            columns, rows, length = struct.unpack_from("<HHI", board.ask(TRUTH, bytes([source])))
            self.assertEqual((columns, rows), (64, 48))
            answer = board.ask(TRUTH, bytes([source]))[8:]
            self.assertIn("focal_length_px:", answer[:length].decode())
            depth = struct.unpack(f"<{64 * 48}f", answer[length:])
            self.assertTrue(all(1700 < d < 1900 for d in depth), (min(depth), max(depth)))
        # Armed for another window: reported.
        board.arm(66, 48)
        self.assertEqual(board.frame()[5] & 1, 1)
        board.arm(64, 50)
        self.assertEqual(board.frame()[5] & 2, 2)
        board.arm(64, 40)
        self.assertEqual(board.frame()[5] & 4, 4)

    def test_waiting_for_frames(self):
        board = self.board
        self.assert_rejection(NO_FRAME_ARMED, board.frame)
        board.arm(64, 48)
        before = board.time_us()
        self.assert_rejection(DEADLINE, board.frame, 3000)
        self.assertEqual(board.time_us(), before + 3000)
        board.ask(FRAME_CANCEL)
        self.assert_rejection(NO_FRAME_ARMED, board.frame)
        board.bring_up()
        board.arm(64, 48)
        self.assertEqual(board.advance(400000, WAKE_FRAME)[1], WAKE_FRAME)
        self.assertEqual(board.advance(400000, WAKE_FRAME)[1], WAKE_FRAME)  # still there
        self.assertEqual(board.frame()[5], 0)

    def test_serial_bytes(self):
        board = self.board
        board.ask(SERIAL_WRITE, b"1?\n")
        self.assertEqual(board.ask(SERIAL_READ), b"")
        self.assertEqual(board.advance(1000000, WAKE_SERIAL)[1], WAKE_SERIAL)
        board.advance(100000)
        text = board.ask(SERIAL_READ).decode()
        self.assertRegex(text, r"^V3LC 1\rZoom:0\d{3}\rFocus:0\d{3}\rIris:0\d{3}\r\n$")
        self.assertEqual(board.ask(SERIAL_READ), b"")

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

    def test_requests_sent_ahead_are_answered_in_order(self):
        self.board.send(FRAME_WAIT, struct.pack("<Q", 10))
        for _ in range(20):
            self.board.send(SERIAL_READ)
        tags = [self.board.receive()[1] for _ in range(21)]
        self.assertEqual(tags, list(range(tags[0], tags[0] + 21)))


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
