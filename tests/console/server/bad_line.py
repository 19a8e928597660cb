# SPDX-License-Identifier: Apache-2.0
"""A bad serial line."""
import os
import pty
import random
import select
import threading
import tty


class BadLine:
    """A serial line between two pseudo terminals that loses and changes bytes."""

    def __init__(self, console, seed, lost, changed):
        self.console = console  # the daemon's side, a Terminal
        self.master, slave = pty.openpty()
        tty.setraw(slave)
        self.slave, self.name = slave, os.ttyname(slave)
        self.chance, self.lost, self.changed = random.Random(seed), lost, changed
        self.carried, self.limit, self.ended = 0, None, False
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def corrupt(self, data):
        result = bytearray()
        for byte in data:
            if self.chance.random() < self.lost:
                continue
            if self.chance.random() < self.changed:
                byte ^= 1 << self.chance.randrange(8)
            result.append(byte)
        return bytes(result)

    def run(self):
        ends = {self.master: self.console.master, self.console.master: self.master}
        while not self.ended:
            for end in select.select(list(ends), [], [], 0.1)[0]:
                data = os.read(end, 4096)
                self.carried += len(data)
                if self.limit is not None and self.carried > self.limit:
                    continue  # unplugged
                data = self.corrupt(data)
                while data:
                    data = data[os.write(ends[end], data):]

    def close(self):
        self.ended = True
        self.thread.join()
        os.close(self.master)
        os.close(self.slave)
