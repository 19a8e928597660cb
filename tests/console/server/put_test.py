# SPDX-License-Identifier: Apache-2.0
"""Files written to a TFTP server by the command put: whole over networks that lose and double
packets, and one line when it fails."""
import os
import socket
import subprocess
import time
import unittest

from daemon_process import TIMEOUT_S, VERGENCED, Client, DaemonTest
from fake_devices import DeviceTest
from tftp_server import TftpServer


class Put(DaemonTest):
    """No rig is needed."""

    @classmethod
    def begin_rig(cls):
        cls.addClassCleanup(lambda: None)

    @classmethod
    def arguments(cls):
        return ["profile=two-cameras", "backend=linux", "left_camera=/dev/none",
                "right_camera=/dev/none2", f"socket={cls.path}", f"files={cls.files}", "store=none"]

    def make(self, name, data):
        path = os.path.join(self.files, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(data)

    def put(self, line):
        with Client(self.path) as client:
            return client.ask(f"put {line}")

    def test_files_of_all_lengths_arrive(self):
        for options, block in ((True, 1024), (False, 512)):
            with TftpServer(options=options) as server:
                for size in (0, 1, block - 1, block, block + 1, 10 * block, 100000):
                    data = os.urandom(size)
                    self.make("data", data)
                    self.assertEqual(self.put(f"data {server.address}/x"),
                                     ["files: 1", f"bytes: {size} bytes", "OK"])
                    self.assertEqual(server.files.pop("x"), data)

    def test_block_numbers_start_again_after_65535(self):
        data = os.urandom(8 * 65540 - 3)
        self.make("long", data)
        with TftpServer(block_bytes=8) as server:
            self.assertEqual(self.put(f"long {server.address}")[-1], "OK")
            self.assertTrue(server.files["long"] == data)

    def test_packets_are_lost_and_doubled(self):
        data = os.urandom(20000)
        self.make("data", data)
        for lose, double in ((0.1, 0), (0, 0.3), (0.1, 0.3)):
            with TftpServer(lose=lose, double=double) as server:
                self.assertEqual(self.put(f"data {server.address}/y")[-1], "OK")
                self.assertEqual(server.files["y"], data)

    def test_a_directory_of_results(self):
        self.make("surface-1/mesh.ply", b"mesh")
        self.make("surface-1/result.json", b"{}")
        with TftpServer(folders=("surface-1", "day")) as server:
            self.assertEqual(self.put(f"surface-1/ {server.address}"),
                             ["files: 2", "bytes: 6 bytes", "OK"])
            self.assertEqual(self.put(f"surface-1/mesh.ply {server.address}/day/")[-1], "OK")
            self.assertEqual(self.put(f"surface-1/mesh.ply {server.address}")[-1], "OK")
            self.assertEqual(server.files,
                             {"surface-1/mesh.ply": b"mesh", "surface-1/result.json": b"{}",
                              "day/mesh.ply": b"mesh", "mesh.ply": b"mesh"})
        with TftpServer() as server:
            answer = self.put(f"surface-1 {server.address}")
            self.assertTrue(answer[-1].startswith("ERR MISSING surface-1/mesh.ply: "), answer)
            self.assertIn("make it at the server", answer[-1])

    def refused(self, line, *parts):
        begin = time.monotonic()
        answer = self.put(line)
        self.assertEqual(len(answer), 1, answer)
        for part in parts:
            self.assertIn(part, answer[0])
        self.assertTrue(answer[0].isprintable(), answer)
        return time.monotonic() - begin

    def test_failures_are_one_line(self):
        self.make("data", os.urandom(5000))
        for code, name in ((0, "IO"), (1, "MISSING"), (2, "REFUSED"), (3, "FULL"), (9, "IO")):
            with TftpServer(rejects=code) as server:
                self.refused(f"data {server.address}/x", f"ERR {name} data: {server.address}/x: "
                             "the server answers: rejected?[2J")
        for address in ("tftp:", "tftp:host/x", "tftp:1.2.3/x", "tftp:1.2.3.4:0/x",
                        "tftp:1.2.3.4:65536/x", "tftp:1.2.3.4x", "192.0.2.1/x", "tftp:::1/x",
                        "tftp:1.2.3.4:/x"):
            self.refused(f"data {address}", "ERR ARGUMENT", "tftp:HOST/NAME")
        self.refused("none tftp:127.0.0.1/x", "ERR MISSING none: ")
        self.refused("../v.sock tftp:127.0.0.1/x", "ERR ")

    def test_no_answer(self):
        self.make("data", os.urandom(5000))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as closed:
            closed.bind(("127.0.0.1", 0))
            where = f"tftp:127.0.0.1:{closed.getsockname()[1]}/x"
            took_s = self.refused(f"data {where}", f"ERR TIMEOUT data: {where}: no answer for 6 s")
            self.assertLess(took_s, 10)
        with TftpServer(dies_after=3) as server:
            self.refused(f"data {server.address}/x", "ERR TIMEOUT")
            self.assertNotIn("x", server.files)

    def test_it_is_cancelled(self):
        self.make("data", os.urandom(1000000))
        with TftpServer(lose=0.2) as server, Client(self.path) as client:
            client.send(f"@progress put data {server.address}/x\n")
            self.assertTrue(client.line().startswith("... "))
            client.send("\x03")
            self.assertTrue(client.begun_answer()[-1].startswith("ERR CANCELLED"))

    def test_without_files(self):
        done = subprocess.run(
            [VERGENCED, *(word for word in self.arguments() if not word.startswith(("files", "so"))),
             "files=none", "socket=none", "console=stdio"],
            input="put data tftp:127.0.0.1/x\n", capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertIn('"files" is not set', done.stdout)


class Unreadable(DeviceTest):
    def test_a_directory_that_cannot_be_listed_is_reported(self):
        self.serve(f"watch {self.files}\nfail 1 0 EIO . readdir\n", "profile=two-cameras",
                   "left_camera=/dev/none", "right_camera=/dev/none2")
        os.makedirs(os.path.join(self.files, "d"))
        with open(os.path.join(self.files, "d", "x"), "wb") as file:
            file.write(b"x")
        with TftpServer() as server:
            self.assertRegex(self.first.ask(f"put d {server.address}")[-1],
                             r"^ERR IO d: Input/output error$")
            self.assertEqual(server.files, {})


if __name__ == "__main__":
    unittest.main()
