# SPDX-License-Identifier: Apache-2.0
"""A client of the simulated rig, as its board or for control (tools/simrig/protocol/simrig_protocol.h)."""
import socket
import struct

MAGIC, VERSION, REPLY = 0x47495256, 1, 0x8000
BOARD, CONTROL = range(2)
HELLO, TIME, ADVANCE = 1, 2, 3
I2C, GPIO_SET, GPIO_GET = 16, 17, 18
FRAME_ARM, FRAME_WAIT, FRAME_CANCEL, SERIAL_WRITE, SERIAL_READ = range(19, 24)
OK, DEADLINE = 0, -10
I2C_FAILURES = range(-9, -4)
DAY_US, SERIAL_BYTES_MAX = 86_400_000_000, 4096
FRAME_HEAD = struct.Struct("<QQIHHI")


class Refused(Exception):
    """The rig refuses a request; the text says why."""


class Rig:
    def __init__(self, where, role=BOARD):
        kind, _, place = where.partition(":")
        try:
            if kind == "unix":
                self.socket = socket.socket(socket.AF_UNIX)
                self.socket.connect(place)
            else:
                host, _, port = place.rpartition(":")
                self.socket = socket.create_connection((host, int(port)))
                self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except (OSError, ValueError) as error:
            raise Refused(f"no rig at {where}: {error} (expected unix:PATH or tcp:HOST:PORT of a "
                          "running simrig)") from error
        self.tag = 0
        greeting = self.ask(HELLO, struct.pack("<IHH", MAGIC, VERSION, role) + b"board in QEMU")
        if struct.unpack_from("<HH", greeting)[1]:
            raise Refused(f"the rig at {where} runs in wall time: start it without --wall")
        self.now_us = self.time_us()

    def exactly(self, size):
        data = bytearray(size)
        view = memoryview(data)
        while view:
            count = self.socket.recv_into(view)
            if count == 0:
                raise EOFError("the rig has closed the connection")
            view = view[count:]
        return bytes(data)

    def exchange(self, kind, body=b""):
        """Status and the rest of the reply."""
        self.tag = (self.tag + 1) & 0xFFFF
        self.socket.sendall(struct.pack("<IHH", len(body), kind, self.tag) + body)
        size, replied, tag = struct.unpack("<IHH", self.exactly(8))
        reply = self.exactly(size)
        if (replied, tag) != (kind | REPLY, self.tag) or size < 4:
            raise Refused("the rig's reply belongs to no request")
        return struct.unpack_from("<i", reply)[0], reply[4:]

    def ask(self, kind, body=b""):
        status, rest = self.exchange(kind, body)
        if status != OK:
            raise Refused(f"the rig refuses request {kind}: {rest.decode(errors='replace')}")
        return rest

    def time_us(self):
        self.now_us = struct.unpack("<Q", self.ask(TIME))[0]
        return self.now_us

    def advance(self, until_us):
        """Lets the rig's time pass until then, if it is not later already; returns it."""
        while self.now_us < until_us:
            step_us = min(until_us, self.now_us + DAY_US)
            self.now_us = struct.unpack("<QI", self.ask(ADVANCE, struct.pack("<QI", step_us, 0)))[0]
        return self.now_us

    def transfer(self, messages, speed_hz):
        """messages: (address, bytes to write or number of bytes to read). Returns how many were done,
        and the bytes read, zeros where none were."""
        body = struct.pack("<IH", speed_hz, len(messages))
        for address, what in messages:
            read = isinstance(what, int)
            body += struct.pack("<BBH", address, read, what if read else len(what))
            body += b"" if read else what
        wanted = sum(what for _, what in messages if isinstance(what, int))
        status, rest = self.exchange(I2C, body)
        if status != OK and status not in I2C_FAILURES:
            return 0, bytes(wanted)  # what this bus cannot do at all
        return struct.unpack_from("<HH", rest)[0], rest[4:].ljust(wanted, b"\0")

    def set_reset(self, active):
        self.ask(GPIO_SET, struct.pack("<I", active))

    def irq(self):
        return struct.unpack_from("<I", self.ask(GPIO_GET))[0] & 1

    def arm(self, columns, rows):
        self.ask(FRAME_ARM, struct.pack("<HH", columns, rows))

    def cancel(self):
        self.ask(FRAME_CANCEL)

    def frame(self, deadline_us):
        """begin_us, end_us, faults, pixels of the armed frame; None if there was none until then."""
        status, rest = self.exchange(FRAME_WAIT, struct.pack("<Q", deadline_us))
        self.time_us()
        if status == DEADLINE:
            return None
        if status != OK:
            raise Refused(f"the rig gives no frame: {rest.decode(errors='replace')}")
        begin_us, end_us, _, _, _, faults = FRAME_HEAD.unpack_from(rest)
        return begin_us, end_us, faults, rest[FRAME_HEAD.size:]

    def serial_write(self, data):
        for at in range(0, len(data), SERIAL_BYTES_MAX):
            self.ask(SERIAL_WRITE, data[at:at + SERIAL_BYTES_MAX])

    def serial_read(self):
        return self.ask(SERIAL_READ)
