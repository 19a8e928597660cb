# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, kill and the terminal."""
import fcntl
import json
import os
import pathlib
import pty
import random
import re
import signal
import struct
import subprocess
import termios
import time
import unittest

import numpy

import pairs
from pairs import VERGENCE
from results import result_names


class Signals(pairs.Fixture):
    """On a pair that takes about half a second, so that a signal can arrive in every stage."""

    @classmethod
    def setUpClass(cls):
        left, right, _ = pairs.make_pair(width=900, height=600)
        cls.large = left, right
        cls.delays = random.Random(pairs.SEED)

    def setUp(self):
        super().setUp()
        self.large_left, self.large_right = (self.save(name, image) for name, image in
                                             zip(("ll.ppm", "lr.ppm"), self.large))
        self.command = [VERGENCE, "reconstruct", str(self.large_left), str(self.large_right),
                        "--rectified", "--focal", "500", "--baseline", "100", "--disparity",
                        "0:256", "--out", str(self.out)]

    def measure(self):
        """Duration of an undisturbed run in seconds."""
        begin = time.monotonic()
        subprocess.run(self.command, check=True, capture_output=True)
        return time.monotonic() - begin

    def traces(self):
        return [n for n in self.names() if n not in ("ll.ppm", "lr.ppm")]

    def test_interrupts_stop_within_a_second_and_leave_nothing(self):
        whole = self.measure()
        self.assertGreater(whole, 0.2, "too short to be interrupted")
        subprocess.run(["rm", "-r", str(self.out)], check=True)
        interrupted = 0
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)):
            for _ in range(3):
                delay = self.delays.uniform(0.05, 0.95) * whole
                process = subprocess.Popen(self.command, stdout=subprocess.PIPE,
                                           stderr=subprocess.PIPE, text=True)
                time.sleep(delay)
                process.send_signal(number)
                sent = time.monotonic()
                _, complaint = process.communicate(timeout=30)
                waited = time.monotonic() - sent
                if process.returncode == 0:  # it finished before
                    subprocess.run(["rm", "-r", str(self.out)], check=True)
                    continue
                if process.returncode == -number:  # before the program installed its handler
                    self.assertEqual(self.traces(), [])
                    continue
                interrupted += 1
                self.assertEqual(process.returncode, code)
                self.assertIn("interrupted", complaint)
                self.assertEqual(complaint.count("\n"), 1, complaint)
                # One second; more only on a loaded machine.
                self.assertLess(waited, max(1.0, whole / 2), f"after {delay:.2f} s")
                self.assertEqual(self.traces(), [], f"after {delay:.2f} s")
        self.assertGreater(interrupted, 3)

    def test_kill_leaves_all_or_nothing(self):
        whole = self.measure()
        reference = set(result_names(self.out))
        self.assertIn("result.json", reference)
        subprocess.run(["rm", "-r", str(self.out)], check=True)
        killed = 0
        for _ in range(6):
            process = subprocess.Popen(self.command, stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
            # Mostly while the files are being written.
            time.sleep(self.delays.uniform(0.2, 1.0) * whole)
            process.kill()
            killed += process.wait() == -signal.SIGKILL
            if self.out.exists():
                self.assertEqual(set(result_names(self.out)), reference)
                json.loads((self.out / "result.json").read_text())
                subprocess.run(["rm", "-r", str(self.out)], check=True)
        self.assertGreater(killed, 1)

    def test_kill_while_replacing_never_shows_half_a_file(self):
        whole = self.measure()
        sizes = {n: (self.out / n).stat().st_size for n in result_names(self.out)}
        for _ in range(5):
            process = subprocess.Popen(self.command, stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
            time.sleep(self.delays.uniform(0.4, 1.05) * whole)
            process.kill()
            process.wait()
            for name, size in sizes.items():
                path = self.out / name
                if path.exists() and name not in ("result.json", "report.html", "surface.compact"):
                    self.assertEqual(path.stat().st_size, size, name)
            if (self.out / "result.json").exists():
                json.loads((self.out / "result.json").read_text())


    def await_taken(self, process):
        """Waits until the signal has reached the process, or the process has ended."""
        interrupt = 1 << (signal.SIGINT - 1)
        end = time.monotonic() + 30
        while process.poll() is None and time.monotonic() < end:
            try:
                status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
            except OSError:
                return
            pending = re.findall(r"^(?:SigPnd|ShdPnd):\s*([0-9a-f]+)", status, re.MULTILINE)
            if not any(int(mask, 16) & interrupt for mask in pending):
                return

    def test_a_second_interrupt_ends_at_once_and_reports_what_is_left(self):
        ended = 0
        whole = self.measure()
        subprocess.run(["rm", "-r", str(self.out)], check=True)
        for part in (0.2, 0.3, 0.4, 0.5, 0.6):
            process = subprocess.Popen(self.command, stdout=subprocess.DEVNULL,
                                       stderr=subprocess.PIPE, text=True)
            time.sleep(part * whole)
            process.send_signal(signal.SIGINT)
            self.await_taken(process)  # two pending signals are merged
            process.send_signal(signal.SIGINT)
            _, complaint = process.communicate(timeout=30)
            if process.returncode == -signal.SIGINT and complaint:
                ended += 1
                self.assertEqual(complaint.splitlines()[-1].split(";")[0],
                                 "vergence: ended at once")
                self.assertIn(".vergence-", complaint)
            for name in os.listdir(self.directory):
                if name.startswith(".vergence-") or name == self.out.name:
                    subprocess.run(["rm", "-r", str(self.directory / name)], check=True)
            self.assertEqual(self.traces(), [])
        self.assertGreater(ended, 0)


class Terminal(pairs.Fixture):
    def on_terminal(self, *arguments, interrupt_at=None, columns=80):
        """Runs with standard error on its own terminal, with Ctrl-C once it shows `interrupt_at`;
        returns the exit code and what it showed."""
        master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        process = subprocess.Popen([VERGENCE, *map(str, arguments)], stdin=slave,
                                   stdout=subprocess.DEVNULL, stderr=slave, start_new_session=True,
                                   preexec_fn=lambda: fcntl.ioctl(slave, termios.TIOCSCTTY, 0))
        os.close(slave)
        shown = b""
        while True:
            try:
                part = os.read(master, 4096)
            except OSError:  # Linux reports EIO when the other side is closed
                break
            if not part:
                break
            shown += part
            if interrupt_at is not None and interrupt_at in shown.decode(errors="replace"):
                os.write(master, b"\x03")  # the key itself
                interrupt_at, self.interrupted_s = None, time.monotonic()
        os.close(master)
        return process.wait(timeout=30), shown.decode()

    def test_a_bar_is_no_wider_than_the_window(self):
        for columns in (132, 50):
            code, text = self.on_terminal("reconstruct", self.left_path, self.right_path,
                                          *pairs.RECTIFIED, "--out", self.out, columns=columns)
            self.assertEqual(code, 0)
            shown = text.split("\r")
            bars = [text for text in shown if "%" in text or text.isspace() and text != "\n"]
            self.assertGreater(len(bars), 2, shown)
            self.assertEqual(max(len(bar) for bar in bars), min(columns - 1, 63), shown)

    def test_a_bar_shows_the_stages_and_goes_away(self):
        code, shown = self.on_terminal("reconstruct", self.left_path, self.right_path,
                                       *pairs.RECTIFIED, "--out", self.out)
        self.assertEqual(code, 0)
        stages = re.findall(r"\r(\w+) +\[[#.]{40}\] +\d+ %", shown)
        for stage in ("match", "write"):
            self.assertIn(stage, stages)
        bars = [part for part in shown.split("\r") if "[" in part]
        self.assertLessEqual(max(map(len, bars)), 79)
        # The last output wipes the bar; the rest are whole lines.
        self.assertNotIn("[#", shown.rsplit("\r ", 1)[-1])
        self.assertIn("note: ", shown)

    def large_pair(self, rows, columns):
        return [self.save(name, numpy.tile(image, (rows, columns, 1))) for name, image in
                (("tl.ppm", self.left), ("tr.ppm", self.right))]

    def test_one_bar_for_the_whole_run_moves_on_and_never_back(self):
        matching = {}
        for preset, disparities in (("fast", 256), ("standard", 256), ("best", 600), ("board", 256),
                                    ("paper", 64)):
            left, right = self.large_pair(5, 5) if preset == "best" else self.large_pair(2, 2)
            for threads in (1, 3) if preset in ("standard", "best") else (2,):
                code, shown = self.on_terminal(
                    "reconstruct", left, right, "--rectified", "--disparity", f"0:{disparities}",
                    "--preset", preset, "--threads", threads, "--out", self.out)
                self.assertEqual(code, 0, shown)
                drawn = re.findall(r"\r(\w+) +\[(#*)\.*\] +(\d+) %", shown)
                percents = [int(percent) for _, _, percent in drawn]
                self.assertEqual(percents, sorted(percents), (preset, threads))
                self.assertLessEqual(max(percents), 100)
                self.assertEqual([len(cells) * 100 // 40 <= percent for (_, cells, _), percent in
                                  zip(drawn, percents)], [True] * len(drawn))
                matching[preset, threads] = [p for (stage, _, _), p in zip(drawn, percents)
                                             if stage == "match"]
        # Its bands take a second or so: the bar is drawn ten times a second.
        self.assertGreater(len(set(matching["best", 1])), 5)

    def test_the_key_interrupts_all_presets_while_they_match(self):
        left, right = self.large_pair(9, 7)
        for preset, threads in (("fast", 1), ("standard", 3), ("best", 1), ("best", 2),
                                ("board", 2), ("paper", 1)):
            with self.subTest(preset=preset, threads=threads):
                code, shown = self.on_terminal(
                    "reconstruct", left, right, "--rectified", "--disparity", "0:1024", "--preset",
                    preset, "--threads", threads, "--out", self.out, interrupt_at="match")
                # Within a part of what is left to match; a busy machine is slower.
                self.assertLess(time.monotonic() - self.interrupted_s, 6)
                self.assertEqual(code, 130, shown)
                self.assertFalse(self.out.exists())

    def test_quiet_shows_nothing(self):
        code, shown = self.on_terminal("reconstruct", self.left_path, self.right_path,
                                       *pairs.RECTIFIED, "--out", self.out, "--quiet")
        self.assertEqual((code, shown), (0, ""))

    def test_the_key_interrupts(self):
        left, right = (self.save(name, numpy.tile(image, (9, 8, 1))[:1400, :1800]) for name, image
                       in (("tl.ppm", self.left), ("tr.ppm", self.right)))
        code, shown = self.on_terminal("reconstruct", left, right, "--rectified", "--disparity",
                                       "0:512", "--threads", "1", "--out", self.out,
                                       interrupt_at="match")
        self.assertEqual(code, 130, shown)
        self.assertIn("interrupted", shown)
        self.assertFalse(self.out.exists())


if __name__ == "__main__":
    print(f"seed {pairs.SEED}")
    unittest.main()
