# SPDX-License-Identifier: Apache-2.0
"""The control side of the real process: scenes, poses, truth, timed faults; logs that replay to the
same bytes; snapshots."""
import struct
import unittest

import cv2
import numpy

from simrig_client import (BRIDGE, CONTROLLER, DEADLINE, FAILED, LEFT, NACK_ADDRESS, OK, RIGHT,
                           SCENE, SERIAL_READ, SERIAL_WRITE, STUCK, TRUTH, Bench, Refused)


def take(board, columns=64, rows=48):
    board.arm(columns, rows)
    return board.frame()


def ask_lens(board, wait_us=400000):
    board.ask(SERIAL_WRITE, b"1?\n")
    board.advance(wait_us)
    return board.ask(SERIAL_READ)


class Control(Bench):
    def setUp(self):
        super().setUp()
        self.running = self.start("--files", self.folder)
        self.board = self.running.client()

    def depth(self, camera=0):
        answer = self.board.ask(TRUTH, bytes([camera]))
        columns, rows, length = struct.unpack_from("<HHI", answer)
        return numpy.frombuffer(answer[8 + length:], "<f4").reshape(rows, columns)

    def test_scenes_and_poses(self):
        board = self.board
        board.bring_up()
        take(board)
        self.assertAlmostEqual(numpy.median(self.depth()), 1800, delta=60)
        # Half a metre nearer, at once.
        self.assertEqual(board.control("move board 0 0 -500"), "")
        self.assertAlmostEqual(numpy.median(self.depth()), 1800, delta=60)  # of the last frame
        take(board)
        self.assertAlmostEqual(numpy.median(self.depth()), 1300, delta=60)
        # Turned, later.
        at_s = board.time_us() * 1e-6 + 0.02
        board.control(f"at {at_s} move board 0 0 -500 0 45 0")
        take(board)
        flat = numpy.ptp(self.depth())
        board.advance(40000)
        take(board)
        self.assertGreater(numpy.ptp(self.depth()), 4 * flat + 4)
        other = self.folder / "other.yaml"
        other.write_text(SCENE.replace("[0, 0, 0], size", "[0, 0, 900], size"))
        self.assertRegex(board.control(f"scene {other}"), r"^crc32 [0-9a-f]{8}\n$")
        take(board)
        self.assertAlmostEqual(numpy.median(self.depth()), 2700, delta=90)

    def test_truth_in_files(self):
        board = self.board
        board.bring_up()
        self.assert_rejection(FAILED, board.control, "truth left a")
        take(board)
        for name in ("../x", "/x", "a/b", "", "." * 3, "x" * 65):
            self.assert_rejection(FAILED, board.control, f"truth left {name}")
        self.assertEqual(board.control("truth left a"), 
                         "a.pfm\na_normal.pfm\na_object.pgm\na.yaml\n")
        depth = cv2.imread(str(self.folder / "a.pfm"), cv2.IMREAD_UNCHANGED)
        self.assertTrue(numpy.array_equal(depth, self.depth()))
        self.assertIn("rotation_world_camera:", (self.folder / "a.yaml").read_text())
        plain = self.start()
        self.assertIn("--files", self.assert_rejection(FAILED, plain.client(CONTROLLER).control,
                                                     "view x"))

    def test_faults_of_the_cameras(self):
        board = self.board
        board.bring_up()
        whole = numpy.frombuffer(take(board)[6], "<u2")
        self.assertTrue((whole & 8).any())
        board.control("fault camera left torn 3")
        torn = numpy.frombuffer(take(board)[6], "<u2")
        self.assertFalse((torn & 8).any())
        board.control("fault camera left ok")
        self.assertTrue((numpy.frombuffer(take(board)[6], "<u2") & 8).any())
        at_s = board.time_us() * 1e-6 + 0.02
        board.control(f"at {at_s} fault camera left silent")  # its clock is stopped
        self.assertEqual(take(board)[5], 0)
        board.advance(20000)
        board.arm(64, 48)
        self.assert_rejection(DEADLINE, board.frame, 5000)
        self.assertEqual([board.read(s, 0) for s in (LEFT, RIGHT)], [0x1621, 0x1621])
        board.control("fault camera left unplug")
        self.assert_rejection(NACK_ADDRESS, board.read, LEFT, 0)
        self.assertEqual(board.read(RIGHT, 0), 0x1621)
        board.control("fault camera right stuck")
        self.assertRaises(Refused, board.read, RIGHT, 0)
        self.assertEqual(board.read(BRIDGE, 0), 0x5B1D)

    def test_faults_of_buses_and_lenses(self):
        board = self.board
        board.advance(200)
        for line in ("sda", "scl"):
            board.control(f"fault bus {line}")
            board.advance(10)
            self.assertEqual(board.transfer([(BRIDGE, b"\0")])[0], STUCK)
            board.control("fault bus ok")
            board.advance(10)
            self.assertEqual(board.read(BRIDGE, 0), 0x5B1D)
        board.control("fault lens left zoom jam")
        board.ask(SERIAL_WRITE, b"1Z600\n")
        self.assertRegex(ask_lens(board), rb"Zoom:0(29|30)\d")
        board.control("fault lens left zoom free")
        self.assertIn("lens_moves", board.control("status"))

    def test_faults_of_the_serial_line(self):
        board = self.board
        good = ask_lens(board)
        self.assertTrue(good.startswith(b"V3LC 1\r") and good.endswith(b"\r\n"), good)
        board.control("fault serial silent")
        self.assertEqual(ask_lens(board), b"")
        board.control("fault serial late 300")
        self.assertEqual(ask_lens(board, 250000), b"")
        board.advance(200000)
        self.assertEqual(len(board.ask(SERIAL_READ)), len(good))
        board.control("fault serial split 200")
        board.ask(SERIAL_WRITE, b"1?\n")
        board.advance(150000)
        first = board.ask(SERIAL_READ)
        board.advance(150000)
        rest = board.ask(SERIAL_READ)
        self.assertEqual(len(first + rest), len(good))
        self.assertTrue(first and rest)
        board.control("fault serial garbage 0.5")
        self.assertNotEqual(ask_lens(board)[:7], b"V3LC 1\r")
        board.control("fault serial lost 1")
        self.assertEqual(ask_lens(board), b"")
        board.control("fault serial ok")
        self.assertEqual(len(ask_lens(board)), len(good))


class Replay(Bench):
    def story(self, running):
        """A bit of everything; returns the bytes of all answers with noise."""
        board, control = running.client(), running.client(CONTROLLER)
        board.bring_up()
        control.control(f"at {board.time_us() * 1e-6 + 0.03} fault camera left torn 0")
        answers = [take(board)[6], ask_lens(board, 60000)]
        board.advance(20000)
        answers += [take(board)[6], board.control("status").encode(), board.ask(TRUTH, b"\0")]
        return board, control, answers

    def test_the_same_seed_gives_the_same_bytes(self):
        answers = {}
        for name, seed in (("a", 5), ("b", 5), ("c", 6)):
            running = self.start("--seed", seed)
            answers[name] = self.story(running)[2]
            running.stop()
        self.assertEqual(answers["a"], answers["b"])
        self.assertNotEqual(answers["a"][0], answers["c"][0])

    def replay(self, log):
        done = self.run_simrig("--replay", log)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("all answered as in the log", done.stdout)

    def test_a_log_gives_the_same_answers(self):
        log = self.folder / "run.log"
        running = self.start("--log", log, "--seed", 9)
        self.story(running)
        # Killed, not ended: all answered requests are in the log.
        running.process.kill()
        running.process.wait()
        self.replay(log)
        # An answer that differs from the log is reported in one line.
        text = log.read_bytes()
        mark = text.rindex(struct.pack("<I", 1) + b"\0")  # the body of the question for the truth
        changed = bytearray(text)
        changed[mark - 1] ^= 1
        (self.folder / "changed.log").write_bytes(changed)
        self.assert_refused(self.run_simrig("--replay", self.folder / "changed.log"), 1, "entry ",
                            "not answered as")

    def test_snapshots(self):
        log = self.folder / "run.log"
        running = self.start("--log", log)
        board, control, _ = self.story(running)
        then = board.time_us()
        control.control("snapshot before")
        first = [take(board)[6], ask_lens(board, 60000)]
        board.control("fault camera left unplug")
        control.control("snapshot later")
        control.control("restore before")
        self.assertEqual(board.time_us(), then)
        self.assertEqual([take(board)[6], ask_lens(board, 60000)], first)
        self.assert_rejection(FAILED, control.control, "restore later")
        # Another branch.
        control.control("restore before")
        control.control("fault camera left torn 9")
        self.assertNotEqual(take(board)[6], first[0])
        self.assertEqual(running.stop(), 0)
        self.replay(log)

    @staticmethod
    def flood(control, requests):
        """Requests that change nothing, as long as a command may be."""
        for _ in range(requests):
            try:
                control.control("x" * 4096)
            except Refused:
                pass

    def test_memory_ends_and_snapshots_live_on_in_the_log(self):
        log = self.folder / "run.log"
        for words in ((), ("--log", log)):
            running = self.start(*words)
            control = running.client(CONTROLLER)
            control.control("snapshot early")
            then = control.time_us()
            begin_kib = running.memory_kib()
            self.flood(control, 16000)  # twice what is kept
            self.assertLess(running.memory_kib() - begin_kib, 48 << 10)
            control.advance(1000)
            if words:
                control.control("snapshot late")
                control.advance(1000)
                control.control("restore late")
                self.assertEqual(control.time_us(), then + 1000)
                control.control("restore early")
                self.assertEqual(control.time_us(), then)
            else:
                for command in ("snapshot late", "restore early"):
                    text = self.assert_rejection(FAILED, control.control, command)
                    self.assertIn("--log FILE", text)
            self.assertEqual(running.stop(), 0)

    def test_scripts(self):
        script = self.folder / "script"
        script.write_text("# what goes wrong\nat 0.010 fault bus sda\n\nat 0.020 fault bus ok\n")
        log = self.folder / "run.log"
        running = self.start("--script", script, "--log", log)
        board = running.client()
        results = []
        for _ in range(3):
            results.append(board.transfer([(BRIDGE, b"\0")])[0])
            board.advance(10500)
        self.assertEqual(results, [OK, STUCK, OK])
        running.stop()
        self.replay(log)


if __name__ == "__main__":
    unittest.main()
