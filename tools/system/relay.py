#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""usage: relay.py PATH ADDRESS

Connects each client of the Unix socket PATH with ADDRESS (unix:PATH or tcp:[HOST:]PORT). tools/board
uses it as a way out of a network namespace.
"""
import socket
import sys
import threading

BLOCK_BYTES = 1 << 16


def connect(address):
    """A connection to unix:PATH or tcp:[HOST:]PORT."""
    kind, _, place = address.partition(":")
    if kind == "unix":
        to = socket.socket(socket.AF_UNIX)
        to.connect(place)
        return to
    host, _, port = place.rpartition(":")
    return socket.create_connection((host or "127.0.0.1", int(port)), timeout=10)


def relay(listening, connect_on, only_one=False):
    """From now on each connection to `listening` is connected with the result of connect_on().
    `only_one`: a new client ends the connection of the one before, which is a board that was reset
    and did not say good-bye."""
    threading.Thread(target=accept_all, args=(listening, connect_on, only_one), daemon=True).start()


def accept_all(listening, connect_on, only_one=False):
    before = ()
    while True:
        near, _ = listening.accept()
        end(*before)
        try:
            far = connect_on()
        except OSError:
            near.close()
            continue
        far.settimeout(None)
        before = (near, far) if only_one else ()
        for one, other in ((near, far), (far, near)):
            if one.family == socket.AF_INET:
                one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            threading.Thread(target=copy, args=(one, other), daemon=True).start()


def copy(source, sink):
    """Copies until the source ends, and passes the end on."""
    try:
        while data := source.recv(BLOCK_BYTES):
            sink.sendall(data)
        sink.shutdown(socket.SHUT_WR)
    except OSError:
        end(source, sink)  # one side is gone: so must the other be


def end(*connected):
    for one in connected:
        try:
            one.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass


def main(words):
    if len(words) != 2:
        sys.stderr.write(__doc__)
        return 2
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(words[0])
        listening.listen()
        accept_all(listening, lambda: connect(words[1]))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
