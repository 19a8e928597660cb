# SPDX-License-Identifier: Apache-2.0
"""tools/board.d/vhost.py against a front end written here from the documents of vhost-user and virtio, in
place of QEMU: queues, chains, indirect descriptors, wrapped indices, stop and resume, descriptors."""
import array
import os
import pathlib
import mmap
import select
import socket
import struct
import sys
import tempfile
import unittest

TOOLS = pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tools" / "board.d"
sys.path.insert(0, str(TOOLS))
import rig_bench  # noqa: E402
import vhost  # noqa: E402

SIZE = 1 << 20
GUEST, QEMU = 0x40000000, 0x7F0000000000
TABLE, AVAILABLE, USED, INDIRECT, DATA = 0x1000, 0x2000, 0x3000, 0x4000, 0x10000
ENTRIES = 4
NEXT, WRITE, IN_TABLE = 1, 2, 4


class FrontEnd:
    """QEMU with a guest in it, as far as a device sees them."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(path)
        self.file = os.memfd_create("guest")
        os.ftruncate(self.file, SIZE)
        self.memory = mmap.mmap(self.file, SIZE)
        self.added = self.returned = 0
        self.kick, self.call = os.eventfd(0, os.EFD_NONBLOCK), os.eventfd(0, os.EFD_NONBLOCK)

    def send(self, kind, body=b"", descriptors=(), flags=1):
        extra = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", descriptors))]
        self.socket.sendmsg([struct.pack("<III", kind, flags, len(body)) + body],
                            extra if descriptors else [])

    def begin(self, base=0, events=True):
        self.send(vhost.SET_OWNER)
        self.send(vhost.SET_FEATURES, struct.pack("<Q", vhost.RING_EVENT if events else 0))
        self.send(vhost.SET_MEMORY, struct.pack("<IIQQQQ", 1, 0, GUEST, SIZE, QEMU, 0), [self.file])
        self.send(vhost.SET_NUM, struct.pack("<II", 0, ENTRIES))
        self.send(vhost.SET_BASE, struct.pack("<II", 0, base))
        self.send(vhost.SET_ADDRESSES, struct.pack("<IIQQQQ", 0, 0, QEMU + TABLE, QEMU + USED,
                                                   QEMU + AVAILABLE, 0))
        self.send(vhost.SET_KICK, struct.pack("<Q", 0), [self.kick])
        self.send(vhost.SET_CALL, struct.pack("<Q", 0), [self.call])
        self.send(vhost.SET_ENABLE, struct.pack("<II", 0, 1))
        self.added = self.returned = base

    def answer(self):
        kind, flags, size = struct.unpack("<III", self.socket.recv(12, socket.MSG_WAITALL))
        assert flags == 5, flags
        return kind, self.socket.recv(size, socket.MSG_WAITALL)

    def describe(self, table, number, at, size, flags, following=0):
        struct.pack_into("<QIHH", self.memory, table + 16 * number, GUEST + at, size, flags, following)

    def offer(self, number):
        """Makes the chain that begins with a descriptor available."""
        struct.pack_into("<H", self.memory, AVAILABLE + 4 + 2 * (self.added % ENTRIES), number)
        self.added = (self.added + 1) & 0xFFFF
        struct.pack_into("<H", self.memory, AVAILABLE + 2, self.added)

    def add(self, number, data, room, place):
        """A request in a table of its own: `data` to read, `room` bytes to write at `place`."""
        table = INDIRECT + 0x100 * number
        self.memory[place:place + len(data)] = data
        self.describe(table, 0, place, len(data), NEXT, 1)
        self.describe(table, 1, place + 0x800, room, WRITE)
        self.describe(TABLE, number, table, 32, IN_TABLE)
        self.offer(number)

    def notify(self):
        os.eventfd_write(self.kick, 1)

    def used(self):
        """What has come back since the last call: (number, bytes)."""
        index = struct.unpack_from("<H", self.memory, USED + 2)[0]
        found = []
        while self.returned != index:
            found.append(struct.unpack_from("<II", self.memory,
                                            USED + 4 + 8 * (self.returned % ENTRIES)))
            self.returned = (self.returned + 1) & 0xFFFF
        return found

    def interrupts(self):
        try:
            return os.eventfd_read(self.call)
        except BlockingIOError:
            return 0


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.poll, self.seen, self.whole = rig_bench.Poll(), [], True
        self.device = vhost.Device(f"{folder.name}/device", self.poll, self.handle, features=1,
                                   config=b"abcdef")
        self.addCleanup(self.device.close)
        self.front = FrontEnd(f"{folder.name}/device")
        self.work()

    def handle(self, requests, all_there):
        """Answers with the request's bytes backwards; requests that begin with + need a next one."""
        written = []
        for index, (read, write) in enumerate(requests):
            data = b"".join(read)
            if data.startswith(b"+") and index + 1 == len(requests) and not all_there:
                break
            self.seen.append(data)
            rig_bench.scatter(write, data[::-1])
            written.append(len(data))
        return written

    def work(self):
        while select.select([self.poll.epoll], [], [], 0.01)[0]:
            self.poll.wait(0)

    def test_requests_come_back_in_order_with_their_bytes(self):
        self.front.begin()
        self.front.add(2, b"abc", 8, DATA)
        self.front.add(0, b"wxyz", 8, DATA + 0x1000)
        self.front.notify()
        self.work()
        self.assertEqual(self.front.used(), [(2, 3), (0, 4)])
        self.assertEqual(self.front.memory[DATA + 0x800:DATA + 0x803], b"cba")
        self.assertEqual(self.front.memory[DATA + 0x1800:DATA + 0x1804], b"zyxw")
        self.assertEqual(self.front.interrupts(), 1)

    def test_a_chain_without_a_table_of_its_own(self):
        self.front.begin()
        self.front.memory[DATA:DATA + 6] = b"onetwo"
        self.front.describe(TABLE, 3, DATA, 3, NEXT, 1)
        self.front.describe(TABLE, 1, DATA + 3, 3, NEXT, 0)
        self.front.describe(TABLE, 0, DATA + 16, 2, NEXT | WRITE, 2)
        self.front.describe(TABLE, 2, DATA + 32, 4, WRITE)
        self.front.offer(3)
        self.front.notify()
        self.work()
        self.assertEqual((self.seen, self.front.used()), ([b"onetwo"], [(3, 6)]))
        self.assertEqual(self.front.memory[DATA + 16:DATA + 18] + self.front.memory[DATA + 32:DATA + 36],
                         b"owteno")

    def test_indices_wrap(self):
        for place in AVAILABLE, USED:
            struct.pack_into("<H", self.front.memory, place + 2, 0xFFFE)
        self.front.begin(base=0xFFFE)
        for turn in range(5):
            self.front.add(turn % ENTRIES, b"%d" % turn, 4, DATA)
            self.front.notify()
            self.work()
            self.assertEqual(self.front.used(), [(turn % ENTRIES, 1)])
        self.assertEqual(self.front.interrupts(), 1)  # asked for at index 0 alone: see below

    def test_an_interrupt_comes_when_the_guest_wants_one(self):
        self.front.begin()
        for wanted, interrupts in ((0, 1), (0, 0), (2, 1)):
            struct.pack_into("<H", self.front.memory, AVAILABLE + 4 + 2 * ENTRIES, wanted)
            self.front.add(0, b"a", 4, DATA)
            self.front.notify()
            self.work()
            self.assertEqual(self.front.interrupts(), interrupts)
            # The next kick is asked for by the index of the next request.
            self.assertEqual(struct.unpack_from("<H", self.front.memory, USED + 4 + 8 * ENTRIES)[0],
                             self.front.added)

    def test_without_events_a_flag_keeps_interrupts_away(self):
        self.front.begin(events=False)
        for flags, interrupts in ((0, 1), (1, 0)):
            struct.pack_into("<H", self.front.memory, AVAILABLE, flags)
            self.front.add(0, b"a", 4, DATA)
            self.front.notify()
            self.work()
            self.assertEqual(self.front.interrupts(), interrupts)

    def test_a_request_that_the_guest_still_adds_waits_for_its_kick(self):
        self.front.begin()
        self.front.add(0, b"+a", 4, DATA)
        self.device.run(all_there=False)
        self.assertEqual((self.seen, self.front.used()), ([], []))
        self.front.add(1, b"b", 4, DATA + 0x1000)
        self.front.notify()
        self.work()
        self.assertEqual((self.seen, self.front.used()), ([b"+a", b"b"], [(0, 2), (1, 1)]))

    def test_stop_and_resume_lose_no_request_and_no_descriptor(self):
        self.front.begin()
        self.work()
        before = len(os.listdir("/proc/self/fd"))
        for turn in range(20):
            self.front.send(vhost.GET_BASE, struct.pack("<II", 0, 0))
            self.work()
            kind, body = self.front.answer()
            self.assertEqual((kind, struct.unpack("<II", body)), (vhost.GET_BASE, (0, turn)))
            # Its kick is lost with the old descriptor.
            self.front.add(0, b"%d" % turn, 4, DATA)
            self.work()
            self.assertEqual(self.front.used(), [])
            self.front.added -= 1
            self.front.begin(base=turn)
            self.front.added += 1
            self.work()
            self.assertEqual(self.front.used(), [(0, len(str(turn)))])
        self.assertEqual(len(os.listdir("/proc/self/fd")), before)
        self.assertEqual(len(self.seen), 20)

    def test_memory_that_moves_takes_the_queue_along(self):
        self.front.begin()
        self.work()
        self.front.send(vhost.SET_MEMORY, struct.pack("<IIQQQQ", 1, 0, GUEST, SIZE, QEMU, 0),
                        [self.front.file], flags=9)
        self.work()
        self.assertEqual(self.front.answer(), (vhost.SET_MEMORY, struct.pack("<Q", 0)))
        self.front.add(0, b"a", 4, DATA)
        self.front.notify()
        self.work()
        self.assertEqual(self.front.used(), [(0, 1)])

    def test_what_the_device_is(self):
        self.front.send(vhost.GET_FEATURES)
        self.front.send(vhost.GET_QUEUES)
        self.front.send(vhost.GET_CONFIG, struct.pack("<III", 2, 6, 0) + bytes(6))
        self.work()
        features = struct.unpack("<Q", self.front.answer()[1])[0]
        self.assertEqual(features, 1 | 1 << 28 | 1 << 29 | 1 << 30 | 1 << 32)
        self.assertEqual(self.front.answer()[1], struct.pack("<Q", 1))
        self.assertEqual(self.front.answer()[1], struct.pack("<III", 2, 6, 0) + b"cdef\0\0")

    def test_another_qemu_takes_over(self):
        before = len(os.listdir("/proc/self/fd"))
        self.front.begin()
        self.work()
        self.front.socket.close()
        self.work()
        self.assertEqual(len(os.listdir("/proc/self/fd")), before - 2)  # both ends of the connection

    def test_a_broken_front_end_is_reported(self):
        self.front.begin()
        self.work()
        for break_it, word in (
                (lambda: self.front.describe(TABLE, 0, DATA, 4, NEXT, 0), "descriptor"),
                (lambda: self.front.describe(TABLE, 0, SIZE - 2, 4, 0), "memory"),
                (lambda: self.front.describe(TABLE, 0, DATA, 4, NEXT, 77), "descriptor")):
            break_it()
            self.front.offer(0)
            with self.assertRaisesRegex(vhost.Broken, word):
                self.device.run(all_there=True)
        struct.pack_into("<H", self.front.memory, AVAILABLE + 2, self.front.added + 99)
        self.assertRaisesRegex(vhost.Broken, "queue of 4", self.device.run, True)
        self.assertRaisesRegex(vhost.Broken, "unknown", self.device.answer, 99, b"", [])


class FakeRig:
    """Remembers transfers; a message to address 0x50 is not acknowledged."""

    def __init__(self):
        self.transfers, self.now_us = [], 0

    def transfer(self, messages, _):
        self.transfers.append(messages)
        whole = next((i for i, (address, _) in enumerate(messages) if address == 0x50), len(messages))
        return whole, b"".join(bytes(range(1, what + 1)) for _, what in messages
                               if isinstance(what, int))


class FakeBench:
    def __init__(self):
        self.rig = FakeRig()

    def follow(self):
        return 0


class I2c(unittest.TestCase):
    """Requests of virtio-i2c."""

    def setUp(self):
        self.bench = FakeBench()
        self.bus = rig_bench.Bus(self.bench)

    def request(self, address, what, more):
        """(parts to read, parts to write), and what is written to."""
        read = isinstance(what, int)
        head = struct.pack("<HHI", address << 1, 0, more | 2 * read)
        return (([head], [memoryview(bytearray(what)), memoryview(bytearray(b"?"))]) if read else
                ([head, what], [memoryview(bytearray(b"?"))]))

    def test_chained_requests_are_one_transfer(self):
        requests = [self.request(0x2C, b"\0", 1), self.request(0x2C, 2, 0),
                    self.request(0x5C, b"\7\1\2", 0)]
        self.assertEqual(self.bus.handle(requests, True), [1, 3, 1])
        self.assertEqual(self.bench.rig.transfers, [[(0x2C, b"\0"), (0x2C, 2)], [(0x5C, b"\7\1\2")]])
        self.assertEqual([bytes(part) for part in requests[1][1]], [b"\1\2", b"\0"])

    def test_what_was_not_done_fails(self):
        requests = [self.request(0x2C, b"\0", 1), self.request(0x50, b"\0", 1),
                    self.request(0x50, 2, 0)]
        self.bus.handle(requests, True)
        self.assertEqual([bytes(request[1][-1]) for request in requests], [b"\0", b"\1", b"\1"])

    def test_half_a_transfer_waits_for_the_rest(self):
        requests = [self.request(0x2C, b"\1", 0), self.request(0x2C, b"\0", 1)]
        self.assertEqual(self.bus.handle(requests, False), [1])
        self.assertEqual(len(self.bench.rig.transfers), 1)
        # More messages than the queue has room for: the driver adds what fits and kicks.
        self.assertEqual(self.bus.handle(requests[1:], True), [1])


class Time(unittest.TestCase):
    def test_the_guests_time_is_never_estimated_too_late(self):
        real, host = rig_bench.now_us, [1000]
        self.addCleanup(setattr, rig_bench, "now_us", real)
        rig_bench.now_us = lambda: host[0]
        clock = rig_bench.Clock(5_000_000)
        host[0] += 100
        clock.reported(70_000, starts=True)
        self.assertEqual((clock.now_us(), clock.rig_us()), (70_000, 5_000_100))
        host[0] += 50
        clock.stop()
        host[0] += 9999
        self.assertEqual(clock.now_us(), 70_050)
        clock.resume()
        host[0] += 10
        self.assertEqual(clock.now_us(), 70_060)
        clock.reported(70_055, starts=False)  # sent earlier
        self.assertEqual(clock.now_us(), 70_060)
        clock.reported(70_080, starts=False)
        self.assertEqual((clock.now_us(), clock.rig_us()), (70_080, 5_000_180))


if __name__ == "__main__":
    unittest.main()
