# SPDX-License-Identifier: Apache-2.0
"""A client of the simulated rig, written from the protocol's description alone, and what the tests
share: processes with time limits, files in a temporary directory."""
import os
import pathlib
import re
import shutil
import socket
import struct
import subprocess
import tempfile
import unittest

SIMRIG = os.environ["SIMRIG"]
FILES = pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tools" / "simrig"
TIMEOUT_S = 60

MAGIC, VERSION = 0x47495256, 1
HELLO, TIME, ADVANCE = 1, 2, 3
I2C, GPIO_SET, GPIO_GET = 16, 17, 18
FRAME_ARM, FRAME_WAIT, FRAME_CANCEL, SERIAL_WRITE, SERIAL_READ = range(19, 24)
CONTROL, TRUTH, TRUTH_ROWS = 32, 33, 34
DEPTH, NORMAL, OBJECT = 1, 2, 4
REPLY = 0x8000
OK, BAD_REQUEST, NOT_ALLOWED = 0, -1, -4
NACK_ADDRESS, NACK_DATA, ARBITRATION, TIMEOUT, STUCK = -5, -6, -7, -8, -9
DEADLINE, NO_FRAME_ARMED, FAILED = -10, -11, -12
BOARD, CONTROLLER = 0, 1
WAKE_GPIO = 1
BRIDGE, LEFT, RIGHT = 0x2C, 0x5C, 0x5E

# A scene whose light takes no time to compute.
SCENE = """\
room: {origin_mm: [125, 0, 1800], tilt_deg: 0}
lights:
  - {centre_mm: [-900, -900, -900], half_u_mm: [300, 0, 0], half_v_mm: [0, 300, 0],
     luminance: [600, 600, 600]}
ambient: [300, 300, 300]
floor_ambient: [300, 300, 300]
bounce_lux: 0
materials:
  - print: {kind: board, colours: [[0.8, 0.8, 0.8], [0.05, 0.05, 0.05]],
      board: {columns: 9, rows: 7, square_mm: 40}}
objects:
  - sheet: {name: board, material: print, position_mm: [0, 0, 0], size_mm: [1200, 900]}
"""


class Gone(Exception):
    """The other end has closed the connection."""


class Refused(Exception):
    """A reply with a status other than OK."""

    def __init__(self, status, text):
        super().__init__(f"{status}: {text}")
        self.status, self.text = status, text


class Client:
    def __init__(self, where, role=BOARD, greet=True):
        kind, _, place = where.partition(":")
        if kind == "unix":
            self.socket = socket.socket(socket.AF_UNIX)
            self.socket.settimeout(TIMEOUT_S)
            self.socket.connect(place)
        else:
            host, _, port = place.rpartition(":")
            self.socket = socket.create_connection((host, int(port)), timeout=TIMEOUT_S)
        self.tag = 0
        if greet:
            try:
                self.greeting = self.ask(HELLO, struct.pack("<IHH", MAGIC, VERSION, role) + b"test")
            except Exception:
                self.close()
                raise

    def close(self):
        self.socket.close()

    def send(self, kind, body=b""):
        self.tag = (self.tag + 1) & 0xFFFF
        self.socket.sendall(struct.pack("<IHH", len(body), kind, self.tag) + body)

    def exactly(self, count):
        data = bytearray()
        while len(data) < count:
            try:
                part = self.socket.recv(count - len(data))
            except (ConnectionResetError, BrokenPipeError) as error:
                raise Gone() from error
            if not part:
                raise Gone()
            data += part
        return bytes(data)

    def receive(self):
        """Type, tag, status and the body behind it."""
        length, kind, tag = struct.unpack("<IHH", self.exactly(8))
        body = self.exactly(length)
        return kind, tag, struct.unpack_from("<i", body)[0], body[4:]

    def ask_status(self, kind, body=b""):
        self.send(kind, body)
        got, tag, status, rest = self.receive()
        assert (got, tag) == (kind | REPLY, self.tag), (got, tag)
        return status, rest

    def ask(self, kind, body=b""):
        status, rest = self.ask_status(kind, body)
        if status != OK:
            raise Refused(status, rest.decode())
        return rest

    # ---- requests by name
    def time_us(self):
        return struct.unpack("<Q", self.ask(TIME))[0]

    def advance(self, microseconds, wake=0):
        return struct.unpack("<QI", self.ask(ADVANCE, struct.pack(
            "<QI", self.time_us() + microseconds, wake)))

    def transfer(self, messages, speed_hz=400000):
        """messages: (address, bytes to write or number of bytes to read). Status, whole messages,
        bytes of the one that failed, bytes read."""
        body = struct.pack("<IH", speed_hz, len(messages))
        for address, what in messages:
            read = isinstance(what, int)
            body += struct.pack("<BBH", address, read, what if read else len(what))
            body += b"" if read else what
        status, rest = self.ask_status(I2C, body)
        if status not in (OK, NACK_ADDRESS, NACK_DATA, ARBITRATION, TIMEOUT, STUCK):
            raise Refused(status, rest.decode())
        whole, some = struct.unpack_from("<HH", rest)
        return status, whole, some, rest[4:]

    def write(self, address, index, value):
        return self.transfer([(address, struct.pack(">BH", index, value))])[0]

    def read(self, address, index, words=1):
        status, _, _, data = self.transfer([(address, bytes([index])), (address, 2 * words)])
        if status != OK:
            raise Refused(status, "")
        values = struct.unpack(f">{words}H", data)
        return values[0] if words == 1 else values

    def gpio(self):
        """Levels, and the edges since the last call: (time_us, line, level)."""
        rest = self.ask(GPIO_GET)
        levels, count = struct.unpack_from("<II", rest)
        assert len(rest) == 8 + 10 * count
        return levels, [struct.unpack_from("<QBB", rest, 8 + 10 * i) for i in range(count)]

    def arm(self, columns, rows):
        self.ask(FRAME_ARM, struct.pack("<HH", columns, rows))

    def frame(self, wait_us=500000):
        """begin_us, end_us, number, columns, rows, faults, pixels as bytes."""
        rest = self.ask(FRAME_WAIT, struct.pack("<Q", self.time_us() + wait_us))
        head = struct.unpack_from("<QQIHHI", rest)
        pixels = rest[28:]
        assert len(pixels) == 2 * head[3] * head[4]
        return (*head, pixels)

    def control(self, line):
        return self.ask(CONTROL, line.encode()).decode()

    # ---- a board's driver in a few lines
    def bring_up(self, columns=64, rows=48):
        """Sensors awake with this window; frames of the left one go to the port."""
        self.advance(200)
        assert self.write(BRIDGE, 0x48, 0x00F3) == OK
        for sensor in (LEFT, RIGHT):
            for index, value in ((3, rows - 1), (4, columns - 1), (5, 21), (6, 5), (9, rows),
                                 (1, 20 + 700), (2, 32 + 900)):
                assert self.write(sensor, index, value) == OK
        # The frame in progress is a whole one: while no frame is armed it costs little.
        self.advance(150000)
        assert self.write(BRIDGE, 0x08, 0x0100) == OK
        self.advance(2000)


class Rig:
    """A running simrig."""

    def __init__(self, arguments, folder, environment=None):
        self.out = open(pathlib.Path(folder) / "simrig.err", "w+", encoding="utf-8")
        self.process = subprocess.Popen([SIMRIG, *map(str, arguments)], stdout=subprocess.PIPE,
                                        stderr=self.out, text=True, cwd=folder, env=environment)
        self.lines, self.clients = [], []
        while True:
            line = self.process.stdout.readline()
            if not line:
                raise AssertionError(f"simrig ended: {self.complaint()}")
            self.lines.append(line.rstrip("\n"))
            found = re.match(r"listening on (.*)", line)
            if found:
                self.where = found[1]
                break

    def complaint(self):
        self.out.seek(0)
        return self.out.read()

    def client(self, role=BOARD, greet=True):
        self.clients.append(Client(self.where, role, greet))
        return self.clients[-1]

    def stop(self, how=None):
        """Ends it; returns the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(how or 15)
        code = self.process.wait(TIMEOUT_S)
        self.process.stdout.close()
        return code


class Bench(unittest.TestCase):
    """A test case with a directory, a small scene in it, and rigs that are ended."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="simrig-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.scene = self.folder / "scene.yaml"
        self.scene.write_text(SCENE)
        self.rigs = 0

    def start(self, *arguments, rig="default", scene=None, where=None):
        self.rigs += 1
        base = ["--listen", where or f"unix:{self.folder}/{self.rigs}.sock"]
        if "--from" not in arguments:
            base += ["--scene", scene or self.scene, "--rig", rig]
        running = Rig(base + list(arguments), self.folder)

        def end():
            if running.process.poll() is None:
                running.process.kill()
                running.process.wait()
            running.process.stdout.close()
            running.out.close()
            for client in running.clients:
                client.close()
        self.addCleanup(end)
        return running

    def run_simrig(self, *arguments, **options):
        """Runs a simrig that exits without a signal."""
        return subprocess.run([SIMRIG, *map(str, arguments)], capture_output=True, text=True,
                              timeout=TIMEOUT_S, cwd=self.folder, **options)

    def assert_refused(self, done, code, *words):
        """One clear line on standard error, nothing on standard output, this exit code."""
        self.assertEqual((done.returncode, done.stdout), (code, ""), done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertTrue(done.stderr.startswith("simrig: "), done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)

    def assert_rejection(self, status, call, *arguments):
        with self.assertRaises(Refused) as caught:
            call(*arguments)
        self.assertEqual(caught.exception.status, status, caught.exception.text)
        self.assertNotIn("\n", caught.exception.text)
        return caught.exception.text

