# SPDX-License-Identifier: Apache-2.0
"""Where the daemon writes captures, and their permissions."""
import os
import shutil
import stat
import unittest

from daemon_process import Client, DaemonTest


class Files(DaemonTest):
    """The daemon writes only below "files", and not readable by others."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with Client(cls.path) as client:
            assert client.ask("bringup")[-1] == "OK"
            assert client.ask("window 64 48")[-1] == "OK"

    def setUp(self):
        self.outside = os.path.join(self.folder, "outside")
        os.makedirs(self.outside, exist_ok=True)
        self.addCleanup(shutil.rmtree, self.outside)

    def link(self, name, target=None):
        path = os.path.join(self.files, name)
        os.symlink(target or self.outside, path)
        self.addCleanup(os.remove, path)

    def modes(self, name):
        path = os.path.join(self.files, name)
        return {oct(stat.S_IMODE(os.stat(place).st_mode))
                for place in (os.path.join(path, file) for file in os.listdir(path))}

    def test_no_link_leads_out_of_files(self):
        client = self.client()
        self.link("linked")
        self.link("dangling", os.path.join(self.outside, "none"))
        for command in ("capture linked", "capture dangling", "record start linked",
                        "send linked 4 00000000", "fetch linked/x", "files linked",
                        "reconstruct linked", "replay linked", "calibration set linked/x"):
            with self.subTest(command):
                self.assertTrue(client.ask(command)[-1].startswith("ERR "), command)
                self.assertEqual(os.listdir(self.outside), [])
        # Nor does a link in a directory that was made for the session.
        victim = os.path.join(self.outside, "victim")
        with open(victim, "w", encoding="ascii") as file:
            file.write("mine")
        for number, name in enumerate((".part", "session.index")):
            os.mkdir(os.path.join(self.files, f"made{number}"))
            os.symlink(victim, os.path.join(self.files, f"made{number}", name))
            client.ask(f"capture made{number}")
            with open(victim, encoding="ascii") as file:
                self.assertEqual(file.read(), "mine", name)

    def test_modes_of_a_session(self):
        client = self.client()
        self.assertEqual(client.ask("capture one")[-1], "OK")
        for command in ("record start many", "bringup", "window 64 48", "capture", "record stop"):
            self.assertEqual(client.ask(command)[-1], "OK", command)
        for name in ("one", "many"):
            self.assertEqual(stat.S_IMODE(os.stat(os.path.join(self.files, name)).st_mode), 0o750)
            self.assertEqual(self.modes(name), {"0o640"}, name)

    def test_bug_reports_of_one_second(self):
        client = self.client()
        names = [client.ask_json("bugreport")["result"]["file"] for _ in range(6)]
        self.assertEqual(len(set(names)), 6, names)
        for name in names:
            self.assertTrue(os.path.isfile(os.path.join(self.files, name)))
            self.assertRegex(name, r"^bugreport-\d{8}-\d{6}(-\d+)?\.txt$")


if __name__ == "__main__":
    unittest.main()
