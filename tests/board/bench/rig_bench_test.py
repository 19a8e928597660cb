# SPDX-License-Identifier: Apache-2.0
"""tools/board.d/rig_bench.py as a process between a simulated rig and the front ends of vhost_test.py in
place of QEMU: the rig's own bus, lines, frames and lens controller, and QEMU stopped for each frame."""
import os
import json
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

from vhost_test import DATA, FrontEnd, TOOLS

import rig_bench

SIMRIG = os.environ["SIMRIG"]
TIMEOUT_S = 60
BRIDGE, SENSOR, ABSENT = 0x2C, 0x5C, 0x50


class Qemu(threading.Thread):
    """QMP as far as the bench uses it: remembers the commands."""

    def __init__(self, path):
        super().__init__(daemon=True)
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(path)
        self.listener.listen(1)
        self.commands = []

    def run(self):
        connection, _ = self.listener.accept()
        try:
            with connection, connection.makefile("r") as commands:
                connection.sendall(b'{"QMP": {}}\n')
                for line in commands:
                    self.commands.append(json.loads(line)["execute"])
                    connection.sendall(b'{"event": "ANY"}\n{"return": {}}\n')
        except OSError:
            pass  # the bench was ended in the middle


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        rig = f"unix:{self.folder}/rig.sock"
        self.start([SIMRIG, "--scene", "plane", "--seed", "7", "--listen", rig], "listening")
        self.qemu = Qemu(f"{self.folder}/qmp.sock")
        self.addCleanup(self.qemu.listener.close)
        self.qemu.start()
        self.bench = self.start([sys.executable, "-B", str(TOOLS / "rig_bench.py"), self.folder, rig],
                                "ready")

    def start(self, words, expected):
        child = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, child)
        self.assertTrue(child.stdout.readline().startswith(expected))
        return child

    def end(self, child):
        child.kill()
        child.communicate()

    def connect(self, name):
        connection = socket.socket(socket.AF_UNIX)
        self.addCleanup(connection.close)
        connection.settimeout(TIMEOUT_S)
        connection.connect(f"{self.folder}/{name}.sock")
        return connection

    def front_end(self, name):
        front = FrontEnd(f"{self.folder}/{name}.sock")
        self.addCleanup(front.socket.close)
        front.begin()
        return front

    def request(self, front, *parts):
        """Requests of (bytes to read, room to write); returns what was written of each."""
        for number, (data, room) in enumerate(parts):
            front.add(number, data, room, DATA + 0x1000 * number)
        front.notify()
        end, done = time.monotonic() + TIMEOUT_S, []
        while len(done) < len(parts):
            self.assertLess(time.monotonic(), end)
            done += front.used()
            time.sleep(0.001)
        return [bytes(front.memory[DATA + 0x1000 * number + 0x800:][:size]) for number, size in done]

    def transfer(self, bus, *messages):
        last = len(messages) - 1
        return self.request(bus, *(
            (struct.pack("<HHI", address << 1, 0, (at < last) | 2 * isinstance(what, int)) +
             (b"" if isinstance(what, int) else what), 1 + (what if isinstance(what, int) else 0))
            for at, (address, what) in enumerate(messages)))

    def exactly(self, connection, size):
        data = bytearray()
        while len(data) < size:
            part = connection.recv(size - len(data))
            self.assertTrue(part)
            data += part
        return bytes(data)

    def set_up_sensor(self, bus, columns, rows):
        """A window, and frames of the left sensor at the port, as in a driver's first lines."""
        time.sleep(0.01)
        for address, index, value in ((BRIDGE, 0x48, 0x00F3), (SENSOR, 3, rows - 1),
                                      (SENSOR, 4, columns - 1), (SENSOR, 5, 21), (SENSOR, 6, 5),
                                      (SENSOR, 9, rows), (BRIDGE, 0x08, 0x0100)):
            self.assertEqual(self.transfer(bus, (address, struct.pack(">BH", index, value))), [b"\0"])

    @staticmethod
    def asking(number, width, height, now_us):
        return rig_bench.Camera.MESSAGE.pack(rig_bench.Camera.ASK, number, width, height, 0, now_us)

    def ask(self, camera, *request):
        camera.sendall(self.asking(*request))

    def frame(self, camera):
        head = rig_bench.Camera.FRAME.unpack(self.exactly(camera, rig_bench.Camera.FRAME.size))
        self.assertEqual(head[0], rig_bench.Camera.MAGIC)
        return head, self.exactly(camera, head[2])


class Bench(Case):
    def test_the_bus(self):
        bus = self.front_end("i2c")
        self.assertEqual(self.transfer(bus, (BRIDGE, b"\0"), (BRIDGE, 2)), [b"\0", b"\x5b\x1d\0"])
        self.assertEqual(self.transfer(bus, (ABSENT, b"\0"), (ABSENT, 2))[0], b"\1")
        self.assertEqual(self.transfer(bus, (BRIDGE, b""))[0], b"\0")  # as i2cdetect asks

    def test_the_lines(self):
        lines = self.front_end("gpio")
        bus = self.front_end("i2c")
        get, set_direction, set_value = 4, 3, 5
        out = self.request(lines, *((struct.pack("<HHI", *one), 2) for one in
                                    ((get, 0, 0), (get, 1, 0), (get, 2, 0), (set_direction, 1, 1))))
        self.assertEqual(out, [b"\0\1", b"\0\0", b"\1\0", b"\1\0"])
        names = self.request(lines, (struct.pack("<HHI", 1, 0, 0), 64))
        self.assertEqual(names, [b"\0bridge-reset\0bridge-irq\0"])
        for level, status in ((0, b"\1"), (1, b"\0")):  # while it is in reset it does not answer
            self.request(lines, *((struct.pack("<HHI", *one), 2) for one in
                                  ((set_value, 0, level), (set_direction, 0, 1))))
            time.sleep(0.01)
            self.assertEqual(self.transfer(bus, (BRIDGE, b"\0"))[0], status)

    def test_a_frame_begins_after_it_was_asked_for(self):
        bus, camera = self.front_end("i2c"), self.connect("camera")
        self.set_up_sensor(bus, 64, 48)
        now_us = 3_000_000
        for number in (1, 2, 3):
            begin = time.monotonic()
            self.ask(camera, number, 64, 48, now_us)
            head, pixels = self.frame(camera)
            _, answered, size, damaged, begin_us, end_us = head
            self.assertEqual((answered, size, damaged, len(pixels)), (number, 6144, 0, 6144))
            self.assertGreaterEqual(begin_us, now_us)
            self.assertLess(begin_us, end_us)
            self.assertLess(max(struct.unpack("<3072H", pixels)), 1024)
            # This guest ran meanwhile, so its clock is far ahead of the estimate.
            now_us += int((time.monotonic() - begin) * 1e6) + 1000
        # More often if the machine is so busy that the rig falls behind.
        stops, resumes = self.qemu.commands[1::2], self.qemu.commands[2::2]
        self.assertGreaterEqual(len(stops), 3)
        self.assertEqual((set(stops), set(resumes)), ({"stop"}, {"cont"}))

    def test_a_request_that_is_withdrawn_or_replaced(self):
        bus, camera = self.front_end("i2c"), self.connect("camera")
        self.ask(camera, 1, 64, 48, 1000)  # no frame comes: the sensors are off
        time.sleep(0.5)
        camera.sendall(rig_bench.Camera.MESSAGE.pack(rig_bench.Camera.CANCEL, 1, 64, 48, 0, 400000))
        self.set_up_sensor(bus, 64, 48)
        time.sleep(0.5)
        # Together, so that no frame of the first is sent between them.
        camera.sendall(self.asking(2, 64, 48, 2_000_000) + self.asking(3, 64, 48, 2_001_000))
        self.assertEqual(self.frame(camera)[0][1], 3)

    def test_the_lens_controller_answers(self):
        lens = self.connect("lens")
        lens.sendall(b"1?\n")
        self.assertEqual(self.exactly(lens, 6), b"V3LC 1")

    def test_another_qemu_takes_over(self):
        for _ in range(2):
            bus = self.front_end("i2c")
            self.assertEqual(self.transfer(bus, (BRIDGE, b"\0"), (BRIDGE, 2))[1], b"\x5b\x1d\0")
            bus.socket.close()

    def test_signals_and_errors(self):
        self.bench.send_signal(signal.SIGTERM)
        self.assertEqual((self.bench.wait(TIMEOUT_S), self.bench.stderr.read()), (0, ""))
        for words, code, text in (
                ([], 2, "expected FOLDER RIG"), (["--what", "x"], 2, "expected"),
                ([self.folder, "unix:/nosuch"], 1, "no rig at unix:/nosuch"),
                ([self.folder, "rig"], 1, "expected unix:PATH or tcp:HOST:PORT"),
                (["/nosuch", f"unix:{self.folder}/rig.sock"], 1, "/nosuch")):
            done = subprocess.run([sys.executable, "-B", str(TOOLS / "rig_bench.py"), *words],
                                  capture_output=True, text=True, timeout=TIMEOUT_S)
            self.assertEqual((done.returncode, done.stdout), (code, ""), words)
            self.assertRegex(done.stderr, rf"^rig_bench.py: [^\n]*{text}[^\n]*\n$")

    def test_a_rig_that_goes_ends_the_bench(self):
        other = f"unix:{self.folder}/other.sock"
        os.mkdir(f"{self.folder}/b")
        rig = self.start([SIMRIG, "--scene", "plane", "--listen", other], "listening")
        bench = self.start([sys.executable, "-B", str(TOOLS / "rig_bench.py"), f"{self.folder}/b",
                            other], "ready")
        rig.kill()
        self.assertEqual(bench.wait(TIMEOUT_S), 1)
        self.assertRegex(bench.stderr.read(), r"^rig_bench.py: [^\n]*(rig|pipe)[^\n]*\n$")

    def test_the_help_and_qemus_options(self):
        done = subprocess.run([sys.executable, "-B", str(TOOLS / "rig_bench.py"), "--help"], text=True,
                              capture_output=True, timeout=TIMEOUT_S, check=True)
        self.assertIn("usage: rig_bench.py FOLDER RIG", done.stdout)
        done = subprocess.run([sys.executable, "-B", str(TOOLS / "rig_bench.py"), "--qemu", "/place"],
                              text=True, capture_output=True, timeout=TIMEOUT_S, check=True)
        for name in rig_bench.SOCKETS + (rig_bench.QMP_SOCKET,):
            self.assertIn(f"/place/{name}", done.stdout)


if __name__ == "__main__":
    unittest.main()
