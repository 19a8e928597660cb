# SPDX-License-Identifier: Apache-2.0
"""Random and mutated messages to the running process: it answers or closes, never hangs, never
ends, and still works afterwards. SIMRIG_FUZZ_MESSAGES and VERGENCE_SEED make longer searches."""
import os
import random
import socket
import struct
import unittest

from simrig_client import (ADVANCE, BRIDGE, CONTROL, CONTROLLER, FRAME_ARM, FRAME_CANCEL,
                           FRAME_WAIT, GPIO_GET, GPIO_SET, HELLO, I2C, MAGIC, SERIAL_READ,
                           SERIAL_WRITE, TIME, TRUTH, TRUTH_ROWS, Bench, Gone)

SEED = int(os.environ.get("VERGENCE_SEED", "20090915"))
MESSAGES = int(os.environ.get("SIMRIG_FUZZ_MESSAGES", "4000"))
LINES = ("status", "help", "fault servo left jam", "fault lens right zoom jam", "fault bus sda",
         "fault bus ok", "fault camera left torn 3", "fault camera right silent",
         "fault camera left unplug", "fault camera left ok", "fault camera right ok",
         "fault serial garbage 0.3", "fault serial ok", "at 0.5 fault bus scl",
         "at 0.6 fault bus ok", "truth left x", "move board 1 2 3", "snapshot a", "scene nosuch")


class Maker:
    def __init__(self, seed):
        self.random = random.Random(seed)

    def number(self, bits):
        """Small numbers, large numbers, powers of two and their neighbours."""
        chance = self.random
        value = chance.choice((chance.getrandbits(bits), chance.getrandbits(4),
                               (1 << chance.randrange(bits)) + chance.randint(-1, 1), 0, -1))
        return value & ((1 << bits) - 1)

    def bytes(self, maximum):
        return self.random.randbytes(self.random.randint(0, maximum))

    def transfer(self):
        chance = self.random
        count = chance.randint(1, 3)
        body = struct.pack("<IH", chance.choice((100000, 400000, self.number(32))), count)
        for _ in range(count):
            read, length = chance.getrandbits(1), chance.randint(0, 8)
            address = chance.choice((BRIDGE, 0x5C, 0x5D, 0x5E, chance.getrandbits(7)))
            body += struct.pack("<BBH", address, read, length)
            body += b"" if read else chance.randbytes(length)
        return body

    def message(self, now_us):
        """Kind and body of a valid message, before mutation."""
        chance = self.random
        soon = now_us + chance.randint(0, 3000)
        return chance.choice((
            lambda: (TIME, b""), lambda: (ADVANCE, struct.pack("<QI", soon, chance.randint(0, 7))),
            lambda: (I2C, self.transfer()),
            lambda: (GPIO_SET, struct.pack("<I", chance.randint(0, 1))), lambda: (GPIO_GET, b""),
            lambda: (FRAME_ARM, struct.pack("<HH", self.number(6), self.number(6))),
            lambda: (FRAME_WAIT, struct.pack("<Q", soon)), lambda: (FRAME_CANCEL, b""),
            lambda: (SERIAL_WRITE, chance.choice((b"1?\n", b"2Z400\n", self.bytes(80)))),
            lambda: (SERIAL_READ, b""), lambda: (CONTROL, chance.choice(LINES).encode()),
            lambda: (TRUTH, bytes([chance.getrandbits(1)])),
            lambda: (TRUTH_ROWS, struct.pack("<BBHH", chance.getrandbits(1), self.number(3),
                                             self.number(6), self.number(6))),
            lambda: (HELLO, struct.pack("<IHH", MAGIC, 1, chance.randint(0, 2)))))()

    def mutated(self, kind, body):
        chance = self.random
        body = bytearray(body)
        what = chance.randrange(8)
        if what == 0 and body:
            body[chance.randrange(len(body))] = self.number(8)
        elif what == 1:
            body = body[:chance.randint(0, len(body))]
        elif what == 2:
            body += self.bytes(20)
        elif what == 3:
            kind = self.number(16)
        # Requested times must stay short, because the test waits for them.
        if kind in (ADVANCE, FRAME_WAIT) and what < 4:
            kind = TIME
        return kind, bytes(body)


class LiveFuzz(Bench):
    def talk(self, running, maker, count):
        """Until the other end closes or count messages are answered; returns how many were."""
        client = running.client()
        now_us = 0
        for done in range(count):
            kind, body = maker.mutated(*maker.message(now_us))
            try:
                status, rest = client.ask_status(kind, body)
            except Gone:
                return done
            if kind == TIME and status == 0:
                now_us = struct.unpack("<Q", rest)[0]
            if status != 0 and kind != I2C:
                self.assertTrue(rest and b"\n" not in rest, (kind, body, rest))
        client.close()
        return count

    def test_mutated_messages(self):
        print(f"seed {SEED}, {MESSAGES} messages")
        maker = Maker(SEED)
        running = self.start("--log", "fuzz.log")
        done = 0
        while done < MESSAGES:
            done += max(1, self.talk(running, maker, min(400, MESSAGES - done)))
            self.assertIsNone(running.process.poll(), running.complaint())
        control = running.client(CONTROLLER)
        control.control("fault bus ok")
        control.close()
        board = running.client()
        board.ask(GPIO_SET, b"\0\0\0\0")
        board.advance(200)
        self.assertEqual(board.read(BRIDGE, 0), 0x5B1D)
        self.assertEqual(running.stop(), 0)
        self.assertEqual(running.complaint(), "")
        done = self.run_simrig("--replay", "fuzz.log")
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_noise(self):
        """Bytes that are not messages, before and after a greeting, cut off anywhere."""
        maker = Maker(SEED + 1)
        running = self.start()
        for _ in range(MESSAGES // 20):
            client = running.client(greet=False)
            if maker.random.getrandbits(1):
                client.socket.sendall(struct.pack("<IHHIHH", 8, HELLO, 1, MAGIC, 1, CONTROLLER))
            try:
                for _ in range(maker.random.randint(1, 4)):
                    length = maker.random.choice((maker.random.randrange(40), maker.number(32)))
                    client.socket.sendall(struct.pack("<IHH", length, maker.number(16), 7))
                    client.socket.sendall(maker.bytes(60))
                client.socket.shutdown(socket.SHUT_WR)
                while client.socket.recv(4096):
                    pass
            except (BrokenPipeError, ConnectionResetError):
                pass
            client.close()
        running.clients.clear()
        self.assertTrue(running.client().time_us() >= 0)
        self.assertEqual(running.stop(), 0)


if __name__ == "__main__":
    unittest.main()
