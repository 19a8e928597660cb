# SPDX-License-Identifier: Apache-2.0
"""A TFTP server (RFC 1350, 2347 to 2349) on 127.0.0.1 for tests, which can lose and double packets,
do without options, and die in the middle of a transfer."""
import random
import select
import socket
import struct
import threading
import time

READ, WRITE, DATA, ACK, ERROR, OPTIONS = range(1, 7)
WAIT_S = 0.3
LAST_WAIT_S = 1.5  # longer than the client waits before it sends a block again
TRIES = 20
LARGEST = 1 << 24


class Dropped(Exception):
    """The transfer has ended at the other side, or nothing comes."""


class TftpServer:
    """`files`: what it has, and gets, by name. `lose`, `double`: of how many packets, from 0 to 1.
    `dies_after`: packets that it sends in a transfer. `rejects`: an error code for writers. `block_bytes`: the most that it accepts."""

    def __init__(self, files=None, options=True, lose=0.0, double=0.0, dies_after=None,
                 rejects=None, folders=(), block_bytes=1024):
        self.files, self.options, self.folders = files if files is not None else {}, options, folders
        self.block_bytes = block_bytes
        self.lose, self.double, self.dies_after = lose, double, dies_after
        self.rejects, self.random = rejects, random.Random(1)
        self.errors = []  # that clients sent
        self.peers = set()  # of transfers under way: their requests may come again
        self.ends = threading.Event()
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.address = f"tftp:127.0.0.1:{self.socket.getsockname()[1]}"
        self.threads = [threading.Thread(target=self.listen)]
        self.threads[0].start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.ends.set()
        for thread in self.threads:
            thread.join()
        self.socket.close()

    def listen(self):
        while not self.ends.is_set():
            if select.select([self.socket], [], [], 0.05)[0]:
                request, peer = self.socket.recvfrom(65536)
                if peer not in self.peers and not self.chance(self.lose):
                    self.peers.add(peer)
                    thread = threading.Thread(target=self.serve, args=(request, peer))
                    self.threads.append(thread)
                    thread.start()

    def chance(self, share):
        return self.random.random() < share

    def serve(self, request, peer):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
            own.bind(("127.0.0.1", 0))
            try:
                Transfer(self, own, peer).run(request)
            except Dropped:
                pass
            finally:
                self.peers.discard(peer)  # its port may become another transfer's


class Transfer:
    def __init__(self, server, own, peer):
        self.server, self.own, self.peer = server, own, peer
        self.block_bytes, self.sent = 512, 0

    def run(self, request):
        kind, = struct.unpack("!H", request[:2])
        name, mode, *words = request[2:].decode().split("\0")[:-1]
        assert mode.lower() == "octet", request
        asked = {key.lower(): int(value) for key, value in zip(words[::2], words[1::2])}
        if kind == READ:
            self.give(name, asked)
        elif kind == WRITE:
            self.take(name, asked)

    def send(self, packet):
        if self.server.dies_after is not None and self.sent >= self.server.dies_after:
            raise Dropped
        self.sent += 1
        for _ in range(2 if self.server.chance(self.server.double) else 1):
            if not self.server.chance(self.server.lose):
                self.own.sendto(packet, self.peer)

    def refuse(self, code, text):
        self.own.sendto(struct.pack("!HH", ERROR, code) + text.encode() + b"\0", self.peer)

    def exchange(self, packet, wanted):
        """Sends until the wanted answer comes."""
        for _ in range(TRIES):
            self.send(packet)
            while select.select([self.own], [], [], WAIT_S)[0]:
                answer, peer = self.own.recvfrom(65536)
                assert peer == self.peer, peer
                kind, number = struct.unpack("!HH", answer[:4])
                if kind == ERROR:
                    self.server.errors.append((number, answer[4:-1].decode()))
                    raise Dropped
                if (kind, number) == wanted:
                    return answer[4:]
            if self.server.ends.is_set():
                break
        raise Dropped

    def accepted(self, asked, total):
        """The packet that accepts the options, or None."""
        if not self.server.options or not asked:
            return None
        self.block_bytes = min(asked.get("blksize", 512), self.server.block_bytes)
        texts = {"blksize": self.block_bytes} if "blksize" in asked else {}
        texts |= {"tsize": total} if "tsize" in asked else {}
        return struct.pack("!H", OPTIONS) + "".join(f"{key}\0{value}\0" for key, value in
                                                    texts.items()).encode()

    def give(self, name, asked):
        if name not in self.server.files:
            self.refuse(1, "File not found")
            return
        data = self.server.files[name]
        options = self.accepted(asked, len(data))
        if options:
            self.exchange(options, (ACK, 0))
        for block in range(len(data) // self.block_bytes + 1):
            part = data[block * self.block_bytes:(block + 1) * self.block_bytes]
            number = (block + 1) % 65536
            self.exchange(struct.pack("!HH", DATA, number) + part, (ACK, number))

    def take(self, name, asked):
        if self.server.rejects is not None:
            self.refuse(self.server.rejects, "rejected\x1b[2J")
            return
        if "/" in name and name.rsplit("/", 1)[0] not in self.server.folders:
            self.refuse(1, "File not found")
            return
        answer = self.accepted(asked, asked.get("tsize")) or struct.pack("!HH", ACK, 0)
        data, block = b"", 1
        while True:
            part = self.exchange(answer, (DATA, block % 65536))
            data += part
            assert len(data) < LARGEST
            answer = struct.pack("!HH", ACK, block % 65536)
            if len(part) < self.block_bytes:
                break
            block += 1
        if "tsize" in asked:
            assert len(data) == asked["tsize"], (len(data), asked)
        self.server.files[name] = data
        self.send(answer)
        # The last answer may be lost: then the last block comes again.
        end_s = time.monotonic() + LAST_WAIT_S
        while not self.server.ends.is_set() and time.monotonic() < end_s:
            if not select.select([self.own], [], [], 0.05)[0]:
                continue
            if struct.unpack("!HH", self.own.recvfrom(65536)[0][:4]) == (DATA, block % 65536):
                self.send(answer)
