# SPDX-License-Identifier: Apache-2.0
"""Logs of the real process that replay to the same bytes; snapshots; scripts."""
import struct
import unittest

from simrig_client import (BRIDGE, CONTROLLER, FAILED, OK, SCENE, SERIAL_READ, SERIAL_WRITE, STUCK,
                           TRUTH, Bench)


def take(board, columns=64, rows=48):
    board.arm(columns, rows)
    return board.frame()


def ask_lens(board, wait_us=400000):
    board.ask(SERIAL_WRITE, b"1?\n")
    board.advance(wait_us)
    return board.ask(SERIAL_READ)


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

    def test_bad_logs(self):
        log = self.folder / "run.log"
        running = self.start("--log", log)
        running.client().read(BRIDGE, 0)
        self.assertEqual(running.stop(), 0)
        good = log.read_bytes()
        for content, word in ((good[:-3], "within"), (good[:9], "within"), (b"", "not a log"),
                              (b"x" * 99, "not a log"), (good[:-30] + b"\xff" * 30, "")):
            (self.folder / "bad").write_bytes(content)
            self.assert_refused(self.run_simrig("--replay", self.folder / "bad"), 3, word)
        self.scene.write_text(SCENE + "\n")
        self.assert_refused(self.run_simrig("--replay", log), 3, "has changed")


if __name__ == "__main__":
    unittest.main()
