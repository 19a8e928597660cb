# SPDX-License-Identifier: Apache-2.0
"""Files sent to the instrument: complete or not at all, over lines that break, after a kill and
with a full disk; and their use, the saved calibration."""
import base64
import glob
import os
import random
import resource
import signal
import time
import unittest
import zlib

from bad_line import BadLine
from daemon_process import TIMEOUT_S, ConsoleTest
from waiting import wait_until

SEED = int(os.environ.get("VERGENCE_TEST_SEED", random.randrange(1 << 32)))
print(f"VERGENCE_TEST_SEED={SEED}")
SESSION = os.path.join(os.environ["VERGENCE_SESSIONS"], "cylinder_1x")


def crc_of(data):
    return f"{zlib.crc32(data):08X}"


def block_of(name, content, offset, data):
    """The line that sends this block."""
    return (f"send {name} {len(content)} {crc_of(content)} offset={offset} "
            f"block-crc={crc_of(data)} data={base64.b64encode(data).decode()}")


class Send(ConsoleTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.chance = random.Random(SEED)

    def content(self, size):
        """Random bytes and a local file with them."""
        data = self.chance.randbytes(size)
        path = os.path.join(self.folder, "local")
        with open(path, "wb") as file:
            file.write(data)
        return data, path

    def there(self, name):
        with open(os.path.join(self.files, name), "rb") as file:
            return file.read()

    def parts(self):
        return glob.glob(os.path.join(self.files, ".*"))

    def sent(self, *words, where=None):
        done = self.vergence("send", *words, where=where)
        bytes_sent = os.path.getsize(words[0])
        name = os.path.basename(words[-1])
        self.assertEqual((done.returncode, done.stdout, done.stderr),
                         (0, f"written: {name}, {bytes_sent} bytes\nOK\n", ""))

    def refused(self, *words):
        done = self.vergence("send", *words)
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1))
        return done.stderr

    def restart(self):
        """Kills the daemon at any point and starts another."""
        self.daemon.send_signal(signal.SIGKILL)
        self.daemon.wait(TIMEOUT_S)
        self.daemon.returncode = 0  # intended: not a crash for the class's clean-up
        os.unlink(self.path)
        self.start()

    def test_complete_files(self):
        for size in (0, 1, 287, 288, 289, 5000):
            data, path = self.content(size)
            self.sent(path, "name.bin")
            self.assertEqual(self.there("name.bin"), data, size)
            self.sent(path, "name.bin")
        self.sent(path)
        self.assertEqual(self.there("local"), data)
        self.assertEqual(self.parts(), [])

    def test_what_is_refused(self):
        _, path = self.content(10)
        self.assertIn("plain name", self.refused(path, "../x"))
        self.assertIn("plain name", self.refused(path, ".x"))
        self.assertIn("No such file", self.refused("/no/such/file"))
        self.assertIn("not a file", self.refused("/tmp"))
        os.makedirs(os.path.join(self.files, "directory"), exist_ok=True)
        self.assertIn("not a regular file", self.refused(path, "directory"))
        os.truncate(path, 16 * 1024 * 1024 + 1)
        self.assertIn("16777216", self.refused(path))
        self.assertEqual(self.parts(), [])

    def test_blocks(self):
        client = self.client()
        data = self.chance.randbytes(600)

        def report(offset, block, crc=None):
            line = block_of("b", data, offset, block)
            return client.ask_json(line if crc is None else line.replace(crc_of(block), crc))

        self.assertEqual(report(0, data[:200])["error"], "MISSING")
        announced = client.ask_json(f"send b 600 {crc_of(data)}")
        self.assertEqual(announced["result"], {"have": 0, "whole": "no"})
        self.assertEqual(report(200, data[200:400])["error"], "RANGE")
        self.assertEqual(report(0, data[:200], crc="00000000")["error"], "CRC")
        for _ in range(2):
            self.assertEqual(report(0, data[:200])["result"]["have"], 200)
        self.assertEqual(report(100, data[100:300])["result"]["have"], 300)
        self.assertEqual(report(300, data[300:] + b"x")["error"], "RANGE")
        self.assertFalse(os.path.exists(os.path.join(self.files, "b")))
        report(300, data[300:450])
        for _ in range(2):
            self.assertEqual(report(450, data[450:])["result"], {"have": 600, "whole": "yes"})
        self.assertEqual(self.there("b"), data)
        for part in ("offset=0", "data=AAAA", f"block-crc={crc_of(data)}", "offset=0 data=AAAA"):
            self.assertEqual(client.ask(f"send b 600 {crc_of(data)} {part}")[0][:11], "ERR MISSING")
        self.assertEqual(client.ask("send b 600 0123456x")[0][:10], "ERR SYNTAX")
        self.assertEqual(client.ask_json(
            f"send b 600 {crc_of(data)} offset=0 block-crc={crc_of(data)} data=A===")["error"], "CRC")

    def test_a_kill_in_the_middle(self):
        data, path = self.content(4000)
        old = self.chance.randbytes(100)
        with open(os.path.join(self.files, "k"), "wb") as file:
            file.write(old)
        client = self.client()
        client.ask_json(f"send k 4000 {crc_of(data)}")
        for at in range(0, 1600, 200):
            self.assertTrue(client.ask_json(block_of("k", data, at, data[at:at + 200]))["ok"])
        self.restart()
        self.assertEqual(self.there("k"), old)
        have = self.client().ask_json(f"send k 4000 {crc_of(data)}")["result"]["have"]
        self.assertEqual(have, 1600)
        self.sent(path, "k")
        self.assertEqual((self.there("k"), self.parts()), (data, []))

    def test_a_part_that_was_damaged(self):
        data, path = self.content(4000)
        client = self.client()
        client.ask_json(f"send d 4000 {crc_of(data)}")
        client.ask_json(block_of("d", data, 0, data[:200]))
        with open(self.parts()[0], "r+b") as file:
            file.write(b"something else")
        self.sent(path, "d")
        self.assertEqual((self.there("d"), self.parts()), (data, []))

    def test_a_full_disk(self):
        old, path = self.content(1000)
        self.sent(path, "f")
        data, path = self.content(30000)
        unlimited = resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, (20000, unlimited[1]))
        self.assertTrue(self.refused(path, "f").startswith("vergence: FULL f: "))
        self.assertEqual(self.there("f"), old)
        resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, unlimited)
        have = self.client().ask_json(f"send f 30000 {crc_of(data)}")["result"]["have"]
        self.assertGreater(have, 19000)
        self.sent(path, "f")
        self.assertEqual((self.there("f"), self.parts()), (data, []))

    def test_abandoned_parts_go(self):
        data, path = self.content(1000)
        client = self.client()
        client.ask_json(f"send old 1000 {crc_of(data)}")
        os.utime(self.parts()[0], (1e9, 1e9))
        client.ask_json(f"send new 1000 {crc_of(data)}")
        self.assertEqual([os.path.basename(name)[:5] for name in self.parts()], [".new."])
        self.sent(path, "new")

    def test_answers_that_come_late_over_a_serial_line(self):
        line = BadLine(self.console, SEED, 0, 0)
        self.addCleanup(line.close)
        data, path = self.content(100000)
        process = self.begin("send", path, "late", where=f"serial:{line.name}")
        wait_until(lambda: line.carried >= 5000)
        # For longer than the client waits before it asks again: then each request has an answer.
        self.daemon.send_signal(signal.SIGSTOP)
        try:
            time.sleep(4)
            self.assertIsNone(process.poll())
        finally:
            self.daemon.send_signal(signal.SIGCONT)
        output, reported = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(process.returncode, 0, (output, reported))
        self.assertEqual(self.there("late"), data)

    def test_a_serial_line_that_breaks(self):
        line = BadLine(self.console, SEED, 0, 0)
        self.addCleanup(line.close)
        data, path = self.content(30000)
        line.limit = line.carried + 30000
        process = self.begin("send", path, "broken", where=f"serial:{line.name}")
        wait_until(lambda: line.carried >= line.limit)
        process.kill()  # killed, as a person would not wait for the client to give up
        process.wait(TIMEOUT_S)
        had = os.path.getsize(self.parts()[0])
        self.assertGreater(had, 5000)
        line.limit, before = None, line.carried
        self.sent(path, "broken", where=f"serial:{line.name}")
        self.assertLess(line.carried - before, (len(data) - had) * 2.2 + 3000)
        self.assertEqual(self.there("broken"), data)

    def test_a_calibration(self):
        path, = glob.glob(os.path.join(SESSION, "calibration-*.txt"))
        self.sent(path, "rig.txt")
        asked = self.client().ask_json("calibration set rig.txt")
        self.assertTrue(asked["ok"], asked)
        self.restart()
        self.assertEqual(self.client().ask_json("calibration show")["result"], asked["result"])
        with open(path, encoding="ascii") as file:
            lines = file.read().splitlines()
        body = "".join(("translation_right_left_mm -0.060000000 0.000000000 0.000000000"
                        if line.startswith("translation_") else line) + "\n" for line in lines[:-1])
        with open(os.path.join(self.files, "metres.txt"), "w", encoding="ascii") as file:
            file.write(f"{body}crc32 {zlib.crc32(body.encode()):08x}\n")
        answer, = self.client().ask("calibration set metres.txt")
        self.assertEqual(answer[:12], "ERR BASELINE")
        self.assertIn("possibly in metres", answer)
        self.assertTrue(self.client().ask_json("calibration set metres.txt unit=mm")["ok"])
        self.assertTrue(self.client().ask_json("calibration set rig.txt")["ok"])
        with open(os.path.join(self.files, "bad.txt"), "w", encoding="ascii") as file:
            file.write("vergence-calibration 1\nid x\n")
        answer = self.client().ask("calibration set bad.txt")
        self.assertEqual((len(answer), answer[0][:4]), (1, "ERR "))
        self.assertEqual(self.client().ask("calibration set none.txt")[0][:11], "ERR MISSING")
        self.restart()
        self.assertEqual(self.client().ask_json("calibration")["result"], asked["result"])
        self.assertEqual(self.client().ask("calibration forget"), ["OK"])
        self.restart()
        missing = self.client().ask("calibration show")
        self.assertEqual(len(missing), 1, missing)
        self.assertRegex(missing[0], '^ERR MISSING .*"calibration set FILE"')
        self.assertEqual(self.client().ask("calibration forget")[0][:11], "ERR MISSING")


if __name__ == "__main__":
    unittest.main()
