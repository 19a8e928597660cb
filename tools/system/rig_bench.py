#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""usage: rig_bench.py FOLDER RIG

The bench around a board that QEMU emulates: connects the board's I2C bus, lines, serial port and camera
to a simulated rig (RIG: unix:PATH or tcp:HOST:PORT of a running simrig). FOLDER gets the sockets; after
the line "ready" QEMU can start with the options that --qemu FOLDER prints.

  --qemu FOLDER  prints QEMU's options, one a line, and exits
  --help         this text

While the rig renders a frame, or is slow for another reason, QEMU is stopped, so the guest's clock does
not advance: a slow host makes no deadline pass. Exit code: 0 on SIGTERM or SIGINT; 1 when the rig is gone or QEMU's side is broken, with
the reason on standard error; 2 for wrong usage.
"""
import json
import os
import pathlib
import select
import signal
import socket
import struct
import sys
import time

sys.dont_write_bytecode = True
import rig_client  # noqa: E402
import vhost  # noqa: E402

SOCKETS = ("i2c.sock", "gpio.sock", "lens.sock", "camera.sock")
QMP_SOCKET = "qmp.sock"
BUS_SPEED_HZ = 400000
IDLE_MS, BUSY_MS = 20, 2
LENS_BUSY_US = 5_000_000  # after the last byte to the lens controller
FRAME_STEP_US = 100_000   # the rig is ahead of the guest by at most this while a frame is awaited
# The rig's time passes in steps that grow, to notice soon that it is slower than time itself (a test
# picture of the bridge is simulated clock by clock): if it needs longer than this to reach the guest's
# time, it gets ahead of the guest while that is stopped.
STEP_US, PATIENCE_US, AHEAD_US = 2_000, 10_000, 20_000


def qemu_options(folder):
    """The machine needs highmem=off (else PCI has no I/O ports for the 16550) and memory that other
    processes may map: -M virt,highmem=off,memory-backend=ram -object
    memory-backend-memfd,id=ram,size=64M,share=on."""
    options = ["-qmp", f"unix:{folder}/{QMP_SOCKET},server=on,wait=off"]
    for name, device in (("i2c", "vhost-user-i2c-device"), ("gpio", "vhost-user-gpio-device"),
                         ("lens", "pci-serial"), ("camera", "virtconsole")):
        options += ["-chardev", f"socket,id={name},path={folder}/{name}.sock"]
        options += ["-device", "virtio-serial-device,max_ports=1"] if name == "camera" else []
        options += ["-device", f"{device},chardev={name}"]
    return options


def now_us():
    return time.monotonic_ns() // 1000


class Poll:
    """Calls functions when files can be read or, where there is something to write, written."""

    def __init__(self):
        self.epoll, self.functions = select.epoll(), {}

    def add(self, file, readable, writable=None):
        number = file if isinstance(file, int) else file.fileno()
        self.functions[number] = readable, writable
        self.epoll.register(number, select.EPOLLIN)

    def want_to_write(self, file, wanted):
        self.epoll.modify(file, select.EPOLLIN | (select.EPOLLOUT if wanted else 0))

    def remove(self, file):
        number = file if isinstance(file, int) else file.fileno()
        del self.functions[number]
        self.epoll.unregister(number)

    def wait(self, timeout_ms):
        for number, events in self.epoll.poll(timeout_ms / 1000):
            # An earlier one of these events may have removed it.
            readable, writable = self.functions.get(number, (None, None))
            if readable and events & ~select.EPOLLOUT:
                readable()
            if writable and events & select.EPOLLOUT and number in self.functions:
                writable()


class Clock:
    """The guest's CLOCK_MONOTONIC, never later than it truly is, and the rig's time that belongs to
    it. Between the messages that carry the guest's time it runs with the host's clock, but while the
    guest is stopped."""

    def __init__(self, rig_us):
        self.guest_us, self.at_us = 0, now_us()
        self.stopped = False
        self.rig_ahead_us = rig_us

    def now_us(self):
        return self.guest_us + (0 if self.stopped else now_us() - self.at_us)

    def rig_us(self):
        return self.now_us() + self.rig_ahead_us

    def stop(self):
        self.guest_us, self.stopped = self.now_us(), True

    def resume(self):
        self.at_us, self.stopped = now_us(), False

    def reported(self, guest_us, starts):
        """The guest has said what time it is; `starts`: it has just booted."""
        if starts:
            self.rig_ahead_us += self.now_us() - guest_us
        elif guest_us < self.now_us():
            return  # the message was under way
        self.guest_us, self.at_us = guest_us, now_us()


class Socket(vhost.Server):
    """A device of QEMU's whose bytes go both ways. `lost` is called when its connection ends."""

    def __init__(self, path, poll, received, lost=lambda: None):
        self.received, self.cancel, self.output = received, lost, b""
        super().__init__(path, poll)

    def connected(self):
        self.connection.setblocking(False)
        self.poll.add(self.connection, self.receive, self.flush)

    def lost(self):
        self.output = b""
        self.cancel()

    def receive(self):
        try:
            data = self.connection.recv(65536)
        except BlockingIOError:
            return
        except ConnectionError:
            data = b""
        if data:
            self.received(data)
        else:
            self.disconnect()

    def send(self, data):
        if self.connection is not None:
            self.output = memoryview(bytes(self.output) + data)
            self.flush()

    def flush(self):
        try:
            while self.output:
                self.output = self.output[self.connection.send(self.output):]
        except BlockingIOError:
            pass
        except ConnectionError:
            self.disconnect()
            return
        self.poll.want_to_write(self.connection, bool(self.output))


class Qmp:
    """QEMU's control socket: stops and resumes the guest. Retries while there is no QEMU."""

    def __init__(self, path, poll, lost):
        self.path, self.poll, self.lost = path, poll, lost
        self.connection, self.input, self.waiting = None, b"", []

    def connect(self):
        """Connects if there is a QEMU by now."""
        connection = socket.socket(socket.AF_UNIX)
        try:
            connection.connect(self.path)
        except OSError:
            connection.close()
            return
        self.connection, self.input, self.waiting = connection, b"", []
        self.poll.add(connection, self.receive)
        self.run("qmp_capabilities", lambda: None)

    def run(self, command, done):
        self.waiting.append(done)
        self.connection.sendall(json.dumps({"execute": command}).encode() + b"\n")

    def receive(self):
        try:
            data = self.connection.recv(65536)
        except ConnectionError:
            data = b""
        if not data:
            self.poll.remove(self.connection)
            self.connection.close()
            self.connection = None
            self.lost()
            return
        *lines, self.input = (self.input + data).split(b"\n")
        for line in lines:
            answer = json.loads(line)
            if "error" in answer:
                raise vhost.Broken(f"QMP: {answer['error'].get('desc')}")
            if "return" in answer:
                self.waiting.pop(0)()


class Bus:
    """virtio-i2c: requests that are chained by FAIL_NEXT are one transfer of the rig."""

    ZERO_LENGTH = 1 << 0  # a feature that the driver insists on
    FAIL_NEXT, READ = 1, 2
    HEAD = struct.Struct("<HHI")

    def __init__(self, bench):
        self.bench = bench

    def handle(self, requests, all_there):
        written, chain = [], []
        for index, (read, write) in enumerate(requests):
            data = b"".join(read)
            address, _, flags = self.HEAD.unpack_from(data)
            size = sum(map(len, write)) - 1
            chain.append((address >> 1, size if flags & self.READ else data[self.HEAD.size:], write))
            last = index + 1 == len(requests)
            if not flags & self.FAIL_NEXT or last and all_there:
                written += self.transfer(chain)
                chain = []
        return written

    def transfer(self, chain):
        begin_us = now_us()
        self.bench.follow()
        whole, data = self.bench.rig.transfer([part[:2] for part in chain], BUS_SPEED_HZ)
        written, wire_us = [], 0
        for index, (_, what, write) in enumerate(chain):
            size, sent = (what, 0) if isinstance(what, int) else (0, len(what))
            wire_us += 9_000_000 * (1 + size + sent) // BUS_SPEED_HZ
            scatter(write, data[:size] + bytes([index >= whole]))
            data = data[size:]
            written.append(size + 1)
        # The bus is as slow as the real one, so that the rig gets no further ahead.
        time.sleep(max(0, begin_us + wire_us - now_us()) / 1e6)
        return written


def scatter(parts, data):
    """Writes data into parts of memory."""
    for part in parts:
        size = min(len(part), len(data))
        part[:size] = data[:size]
        data = data[size:]


class Lines:
    """virtio-gpio: wire 0 resets the bridge while low, wire 1 is the bridge's interrupt."""

    GET_NAMES, GET_DIRECTION, SET_DIRECTION, GET_VALUE, SET_VALUE = range(1, 6)
    OUTPUT, INPUT = 1, 2
    NAMES = b"bridge-reset\0bridge-irq\0"
    CONFIG = struct.pack("<HHI", 2, 0, len(NAMES))
    RESET, IRQ = 0, 1

    def __init__(self, bench):
        self.bench = bench
        self.direction, self.level = [0, 0], [1, 0]  # the reset is pulled up

    def handle(self, requests, _):
        written = []
        for read, write in requests:
            answer = self.answer(*struct.unpack("<HHI", b"".join(read)[:8]))
            scatter(write, answer)
            written.append(len(answer))
        return written

    def answer(self, kind, line, value):
        refused = b"\1\0"
        if kind == self.GET_NAMES:
            return b"\0" + self.NAMES
        if line >= len(self.level):
            return refused
        if kind == self.GET_DIRECTION:
            return bytes([0, self.direction[line]])
        if kind == self.GET_VALUE:
            if line == self.IRQ:
                self.bench.follow()
                self.level[line] = self.bench.rig.irq()
            return bytes([0, self.level[line]])
        if kind not in (self.SET_DIRECTION, self.SET_VALUE) or \
                line == self.IRQ and (kind, value) != (self.SET_DIRECTION, self.INPUT):
            return refused
        if kind == self.SET_DIRECTION:
            self.direction[line] = value
        else:
            self.level[line] = value & 1
        if line == self.RESET:
            self.bench.follow()
            self.bench.rig.set_reset(self.direction[line] == self.OUTPUT and not self.level[line])
        return b"\0\0"


class Camera:
    """The driver of firmware/system/driver: renders a frame when the guest asks for one."""

    ASK, CANCEL, RECEIVED = 1, 2, 3
    MESSAGE = struct.Struct("<IIHHIQ")
    FRAME = struct.Struct("<IIIIQQ")
    MAGIC = 0x4D415246

    def __init__(self, bench, path, poll):
        self.bench, self.input = bench, b""
        self.request = None  # (number, width, height) of the frame that is awaited
        self.armed = False
        self.again_us = 0    # the rig's time until which the guest has to come first
        self.socket = Socket(path, poll, self.received, self.cancel)

    def received(self, data):
        self.input += data
        while len(self.input) >= self.MESSAGE.size:
            kind, number, width, height, _, guest_us = self.MESSAGE.unpack_from(self.input)
            self.input = self.input[self.MESSAGE.size:]
            self.bench.clock.reported(guest_us, number == 1 and kind == self.ASK)
            if kind != self.RECEIVED:
                self.cancel()
            if kind == self.ASK:
                self.request, self.again_us = (number, width, height), 0

    def cancel(self):
        if self.armed:
            self.bench.rig.cancel()
        self.request, self.armed = None, False

    def is_due(self):
        return self.request is not None and self.bench.clock.rig_us() >= self.again_us

    def render(self):
        """Lets the rig render, while the guest is stopped; returns the message with the frame."""
        clock, rig = self.bench.clock, self.bench.rig
        begin_us = rig.advance(clock.rig_us())
        if not self.armed:
            rig.arm(*self.request[1:])
            self.armed = True
        self.again_us = begin_us + FRAME_STEP_US
        frame = rig.frame(self.again_us)
        if frame is None:
            return b""
        begin_us, end_us, faults, pixels = frame
        head = self.FRAME.pack(self.MAGIC, self.request[0], len(pixels), int(faults != 0),
                               begin_us - clock.rig_ahead_us, end_us - clock.rig_ahead_us)
        self.request, self.armed = None, False
        return head + pixels


class Bench:
    """All of it, on one event loop."""

    def __init__(self, folder, rig):
        self.rig, self.poll = rig, Poll()
        self.clock = Clock(rig.time_us())
        self.lens_us = -LENS_BUSY_US
        self.slow = False  # the rig falls behind while the guest runs

        def place(name):
            return os.path.join(folder, name)
        bus, lines = Bus(self), Lines(self)
        self.devices = (
            vhost.Device(place("i2c.sock"), self.poll, bus.handle, Bus.ZERO_LENGTH),
            vhost.Device(place("gpio.sock"), self.poll, lines.handle, config=Lines.CONFIG, queues=2))
        self.lens = Socket(place("lens.sock"), self.poll, self.lens_received)
        self.camera = Camera(self, place("camera.sock"), self.poll)
        self.qmp = Qmp(place(QMP_SOCKET), self.poll, self.qemu_ended)

    def follow(self):
        """Brings the rig to the guest's time, if it is not ahead and not slow."""
        begin_us, until_us, step_us = now_us(), self.clock.rig_us(), STEP_US
        while self.rig.now_us < until_us and not self.slow:
            self.rig.advance(min(until_us, self.rig.now_us + step_us))
            step_us *= 2
            self.slow = now_us() - begin_us > PATIENCE_US

    def get_ahead(self):
        begin_us, rig_us = now_us(), self.rig.now_us
        self.rig.advance(self.clock.rig_us() + AHEAD_US)
        self.slow = now_us() - begin_us > self.rig.now_us - rig_us

    def lens_received(self, data):
        self.lens_us = now_us()
        self.follow()
        self.rig.serial_write(data)

    def qemu_ended(self):
        self.camera.cancel()
        if self.clock.stopped:
            self.clock.resume()

    def stopped(self):
        message = self.camera.render() if self.camera.is_due() else b""
        if self.slow:
            self.get_ahead()
        self.qmp.run("cont", self.clock.resume)
        if message:
            self.camera.socket.send(message)

    def tick(self):
        if self.clock.stopped:
            return
        self.follow()
        received = self.rig.serial_read()
        if received:
            self.lens.send(received)
        if self.qmp.connection is None:
            self.slow = False
            self.qmp.connect()
        elif self.camera.is_due() or self.slow and self.clock.rig_us() >= self.rig.now_us:
            self.clock.stop()
            self.qmp.run("stop", self.stopped)

    def run(self):
        while True:
            busy = self.camera.request or self.slow or now_us() - self.lens_us < LENS_BUSY_US
            self.poll.wait(BUSY_MS if busy else IDLE_MS)
            self.tick()


def main(words):
    if words == ["--help"]:
        print(__doc__, end="")
        return 0
    if len(words) == 2 and words[0] == "--qemu":
        print(*qemu_options(words[1]), sep="\n")
        return 0
    if len(words) != 2 or words[0].startswith("-"):
        sys.stderr.write("rig_bench.py: expected FOLDER RIG; see rig_bench.py --help\n")
        return 2
    folder, where = words
    if not os.path.isdir(folder):
        sys.stderr.write(f"rig_bench.py: {folder}: not a folder\n")
        return 1
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: sys.exit(0))
    try:
        for name in SOCKETS:
            path = pathlib.Path(folder, name)
            if path.is_socket():
                path.unlink()
        bench = Bench(folder, rig_client.Rig(where))
        print("ready", flush=True)
        bench.run()
    except (OSError, EOFError, rig_client.Refused, vhost.Broken, ValueError) as error:
        sys.stderr.write(f"rig_bench.py: {error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
