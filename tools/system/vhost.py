# SPDX-License-Identifier: Apache-2.0
"""Devices for QEMU that live in another process: the back end's side of vhost-user and of virtio's split
queues, as far as devices of short requests need them (vhost-user-i2c, vhost-user-gpio).

QEMU passes the guest's memory as files; a request is a list of parts of that memory to read and of
parts to write. Whenever QEMU stops or resumes the guest it takes the queue away and gives it back, each
time with new descriptors, so the old ones are closed here."""
import array
import mmap
import os
import socket
import struct

# Bits of virtio and vhost-user.
RING_INDIRECT, RING_EVENT, PROTOCOL_FEATURES, VERSION_1 = 1 << 28, 1 << 29, 1 << 30, 1 << 32
PROTOCOL_MULTIQUEUE, PROTOCOL_REPLY, PROTOCOL_CONFIG = 1 << 0, 1 << 3, 1 << 9
# Messages of vhost-user.
(GET_FEATURES, SET_FEATURES, SET_OWNER, RESET_OWNER, SET_MEMORY, SET_LOG_BASE, SET_LOG_FD, SET_NUM,
 SET_ADDRESSES, SET_BASE, GET_BASE, SET_KICK, SET_CALL, SET_ERROR, GET_PROTOCOL, SET_PROTOCOL,
 GET_QUEUES, SET_ENABLE) = range(1, 19)
GET_CONFIG, SET_CONFIG = 24, 25
FLAG_VERSION, FLAG_REPLY, FLAG_NEEDS_REPLY = 1, 4, 8
HEAD_BYTES, MESSAGE_BYTES_MAX, DESCRIPTORS_MAX = 12, 4096, 8
# Flags of a descriptor in a queue.
NEXT, WRITE, INDIRECT = 1, 2, 4
DESCRIPTOR_BYTES, CHAIN_MAX = 16, 1024


class Broken(Exception):
    """The other end does not follow the protocol; the text says how."""


class Memory:
    """The guest's memory: regions of (address in the guest, address in QEMU, bytes, mapped file)."""

    def __init__(self):
        self.regions = []

    def replace(self, regions):
        """regions: (guest address, bytes, QEMU's address, offset in the file, descriptor)."""
        self.clear()
        for guest, size, user, offset, descriptor in regions:
            try:
                mapped = mmap.mmap(descriptor, offset + size)
            except (OSError, ValueError) as error:
                raise Broken(f"the guest's memory cannot be mapped ({error}): it must be shared "
                             "(memory-backend-memfd,share=on)") from error
            finally:
                os.close(descriptor)
            self.regions.append((guest, user, size, memoryview(mapped)[offset:offset + size]))

    def clear(self):
        # A mapping ends with its last view; views of requests do not outlive their call.
        self.regions = []

    def view(self, address, size, of_qemu=False):
        for region in self.regions:
            at = address - region[1 if of_qemu else 0]
            if 0 <= at and at + size <= region[2]:
                return region[3][at:at + size]
        raise Broken(f"{size} bytes at {address:#x} are not the guest's memory")


class Queue:
    """A split queue. Requests are taken in order and returned in order. The indices that both sides
    watch are read and written as whole numbers of 16 bits, never byte by byte."""

    def __init__(self, memory):
        self.memory = memory
        self.size = self.taken = 0
        self.addresses = None  # of descriptors, used, available in QEMU's memory
        self.descriptors = self.available = self.used = None
        self.indices_available = self.indices_used = None
        self.events = False

    def place(self, *addresses):
        sizes = DESCRIPTOR_BYTES * self.size, 6 + 8 * self.size, 6 + 2 * self.size
        self.addresses = addresses
        self.descriptors, self.used, self.available = (
            self.memory.view(address, size, True) for address, size in zip(addresses, sizes))
        self.indices_used, self.indices_available = self.used.cast("H"), self.available.cast("H")

    def remove(self):
        self.addresses = self.descriptors = self.used = self.available = None
        self.indices_used = self.indices_available = None

    def waiting(self):
        """How many requests the guest has made available that are not taken."""
        if self.addresses is None:
            return 0
        count = (self.indices_available[1] - self.taken) & 0xFFFF
        if count > self.size:
            raise Broken(f"{count} requests in a queue of {self.size}")
        return count

    def take(self):
        """The next request: its number, parts to read, parts to write."""
        number = self.indices_available[2 + self.taken % self.size]
        self.taken = (self.taken + 1) & 0xFFFF
        read, write = [], []
        table, at, length = self.descriptors, number, self.size
        for _ in range(CHAIN_MAX):
            if at >= length:
                break
            address, size, flags, following = struct.unpack_from("<QIHH", table,
                                                                 DESCRIPTOR_BYTES * at)
            if flags & INDIRECT:
                table, at, length = self.memory.view(address, size), 0, size // DESCRIPTOR_BYTES
                continue
            if size:
                (write if flags & WRITE else read).append(self.memory.view(address, size))
            if not flags & NEXT:
                return number, read, write
            at = following
        raise Broken(f"descriptor {at} of {length} in a queue")

    def give_back(self, numbers_and_bytes):
        """Returns requests with the number of bytes written; whether the guest wants an interrupt."""
        begin = index = self.indices_used[1]
        for number, written in numbers_and_bytes:
            struct.pack_into("<II", self.used, 4 + 8 * (index % self.size), number, written)
            index = (index + 1) & 0xFFFF
        self.indices_used[1] = index
        if self.events:
            wanted = self.indices_available[2 + self.size]
            return (index - wanted - 1) & 0xFFFF < (index - begin) & 0xFFFF
        return not self.indices_available[0] & 1

    def ask_for_kick(self):
        """The guest reports the next request that it adds."""
        if self.events and self.addresses is not None:
            self.indices_used[2 + 4 * self.size] = self.taken


class Server:
    """A listening socket for one QEMU at a time: a new connection replaces the one before.
    `poll.add(file, function)` and `poll.remove(file)` watch its descriptors. Derived classes watch the
    connection in connected(), and forget what belonged to it in lost()."""

    def __init__(self, path, poll):
        self.poll, self.connection = poll, None
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(path)
        self.listener.listen(1)
        poll.add(self.listener, self.accept)

    def accept(self):
        connection, _ = self.listener.accept()
        self.disconnect()
        self.connection = connection
        self.connected()

    def disconnect(self):
        if self.connection is not None:
            self.poll.remove(self.connection)
            self.connection.close()
            self.connection = None
            self.lost()

    def close(self):
        self.disconnect()
        self.poll.remove(self.listener)
        self.listener.close()


class Device(Server):
    """A device of vhost-user. `handle(requests, all_there)` carries out requests of the first queue, a list of
    (parts to read, parts to write), and returns the bytes written of each; of fewer if the last ones
    belong to a request that the guest is still adding, which is possible unless `all_there`."""

    def __init__(self, path, poll, handle, features=0, config=b"", queues=1):
        self.handle, self.config = handle, config
        self.features = features | VERSION_1 | RING_INDIRECT | RING_EVENT | PROTOCOL_FEATURES
        self.memory = Memory()
        self.queues = [Queue(self.memory) for _ in range(queues)]
        self.kicks, self.calls = [None] * queues, [None] * queues
        super().__init__(path, poll)

    def connected(self):
        self.poll.add(self.connection, self.receive)

    def lost(self):
        for index in range(len(self.queues)):
            self.set_kick(index, None)
            self.set_call(index, None)
            self.queues[index] = Queue(self.memory)
        self.memory.clear()

    # ---- the queue

    def set_kick(self, index, descriptor):
        old, self.kicks[index] = self.kicks[index], descriptor
        if old is not None:
            self.poll.remove(old)
            os.close(old)
        if descriptor is not None:
            self.poll.add(descriptor, lambda: self.kicked(index))

    def set_call(self, index, descriptor):
        old, self.calls[index] = self.calls[index], descriptor
        if old is not None:
            os.close(old)

    def kicked(self, index):
        os.read(self.kicks[index], 8)
        if index == 0:
            self.run(all_there=True)

    def run(self, all_there):
        """Carries out what waits."""
        queue = self.queues[0]
        while True:
            begin, requests = queue.taken, []
            while queue.waiting():
                requests.append(queue.take())
            written = self.handle([request[1:] for request in requests], all_there)
            queue.taken = (begin + len(written)) & 0xFFFF
            if written:
                done = [(request[0], count) for request, count in zip(requests, written)]
                if queue.give_back(done) and self.calls[0] is not None:
                    os.write(self.calls[0], struct.pack("<Q", 1))
            queue.ask_for_kick()
            if queue.waiting() == len(requests) - len(written):
                return
            # Added meanwhile, and perhaps without a kick. One that is incomplete brings a kick.
            all_there = False

    def run_if_ready(self):
        """A kick from before the guest was stopped is lost, the request is not."""
        if self.queues[0].addresses and None not in (self.kicks[0], self.calls[0]):
            self.run(all_there=True)

    # ---- messages

    def receive(self):
        try:
            head, descriptors = self.read_head()
            kind, flags, size = struct.unpack("<III", head)
            answer = self.answer(kind, self.read_exactly(size), descriptors)
            if answer is None and flags & FLAG_NEEDS_REPLY:
                answer = struct.pack("<Q", 0)
            if answer is not None:
                self.connection.sendall(struct.pack("<III", kind, FLAG_VERSION | FLAG_REPLY,
                                                    len(answer)) + answer)
            if kind in (SET_KICK, SET_CALL, SET_ENABLE):
                self.run_if_ready()
        except ConnectionError:
            self.disconnect()

    def read_head(self):
        descriptors = array.array("i")
        head, extra, _, _ = self.connection.recvmsg(
            HEAD_BYTES, socket.CMSG_SPACE(DESCRIPTORS_MAX * descriptors.itemsize))
        for level, kind, data in extra:
            if (level, kind) == (socket.SOL_SOCKET, socket.SCM_RIGHTS):
                descriptors.frombytes(data)
        return head + self.read_exactly(HEAD_BYTES - len(head)), list(descriptors)

    def read_exactly(self, size):
        if size > MESSAGE_BYTES_MAX:
            raise Broken(f"a message of {size} bytes")
        data = b""
        while len(data) < size:
            part = self.connection.recv(size - len(data))
            if not part:
                raise ConnectionError
            data += part
        return data

    def answer(self, kind, body, descriptors):
        """Carries out a message; returns the reply's body, or None."""
        if kind == SET_MEMORY:
            self.set_memory(body, descriptors)
            return None
        descriptor = descriptors.pop(0) if kind in (SET_KICK, SET_CALL) and descriptors else None
        for unused in descriptors:
            os.close(unused)
        if kind in (SET_KICK, SET_CALL):
            index = struct.unpack("<Q", body)[0] & 0xFF
            (self.set_kick if kind == SET_KICK else self.set_call)(index, descriptor)
        elif kind == SET_FEATURES:
            for queue in self.queues:
                queue.events = bool(struct.unpack("<Q", body)[0] & RING_EVENT)
        elif kind == GET_FEATURES:
            return struct.pack("<Q", self.features)
        elif kind == GET_PROTOCOL:
            return struct.pack("<Q", PROTOCOL_MULTIQUEUE | PROTOCOL_REPLY |
                               (PROTOCOL_CONFIG if self.config else 0))
        elif kind == GET_QUEUES:
            return struct.pack("<Q", len(self.queues))
        elif kind == GET_CONFIG:
            offset, size, _ = struct.unpack_from("<III", body)
            return body[:12] + self.config[offset:offset + size].ljust(size, b"\0")
        elif kind in (SET_NUM, SET_BASE, SET_ADDRESSES, GET_BASE):
            return self.answer_queue(kind, body)
        elif kind not in (SET_OWNER, RESET_OWNER, SET_PROTOCOL, SET_ERROR, SET_ENABLE, SET_CONFIG):
            raise Broken(f"an unknown message: {kind}")
        return None

    def answer_queue(self, kind, body):
        index = struct.unpack_from("<I", body)[0]
        queue = self.queues[index]
        if kind == SET_NUM:
            queue.size = struct.unpack("<II", body)[1]
        elif kind == SET_BASE:
            queue.taken = struct.unpack("<II", body)[1]
        elif kind == SET_ADDRESSES:
            queue.place(*struct.unpack_from("<QQQ", body, 8))
        else:
            # The guest stops. Nothing is under way, as requests are carried out at once.
            self.set_kick(index, None)
            queue.remove()
            return struct.pack("<II", index, queue.taken)
        return None

    def set_memory(self, body, descriptors):
        count = struct.unpack_from("<I", body)[0]
        if count != len(descriptors) or len(body) < 8 + 32 * count:
            raise Broken(f"{count} regions of memory with {len(descriptors)} descriptors")
        self.memory.replace([(*struct.unpack_from("<QQQQ", body, 8 + 32 * i), descriptors[i])
                             for i in range(count)])
        for queue in self.queues:
            if queue.addresses is not None:
                queue.place(*queue.addresses)
