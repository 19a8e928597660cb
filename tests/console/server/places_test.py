# SPDX-License-Identifier: Apache-2.0
"""A user without root and without settings: where the daemon's files are, how the client finds it,
and that the two lines printed by "vergence simulate" work as written."""
import json
import signal
import stat
import unittest

from as_user import VERGENCE, UserTest
from daemon_process import TIMEOUT_S, SIMRIG, VERGENCED

CAMERAS = ("profile=two-cameras", "left_camera=/dev/none1", "right_camera=/dev/none2")


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


class Places(UserTest):
    def test_a_user_needs_no_settings(self):
        output_text = self.begin_daemon(VERGENCED, *CAMERAS)
        files = self.home / ".local" / "share" / "vergence" / "files"
        places = {"socket": self.socket, "files": files, "store": self.state / "store",
                  "log": self.state / "vergenced.log"}
        for what, place in places.items():
            self.assertIn(f"{what}: {place}\n", output_text)
            self.assertTrue(place.exists(), place)
        for made in (self.socket.parent, self.state, self.state / "store", files.parent):
            self.assertEqual(mode(made), 0o700, made)
        self.assertEqual(mode(files), 0o750)
        self.assertIn("build", self.assert_answers("version"))
        self.assertTrue(json.loads(self.assert_answers("--json", "version"))["ok"])
        self.assertIn("build", self.ask(input="version\n").stdout)
        self.assertIn("build", self.ask("--json", input="version\n").stdout)
        self.assertIn("build", self.assert_answers(f"unix:{self.socket}", "version"))
        self.daemon.send_signal(signal.SIGTERM)
        self.assertEqual(self.daemon.wait(TIMEOUT_S), 0)
        self.assertIn("serving", places["log"].read_text())

    def test_variables_name_other_places(self):
        other = self.folder / "other"
        self.environment |= {"XDG_STATE_HOME": str(other / "state"), "XDG_DATA_HOME": "relative"}
        del self.environment["XDG_RUNTIME_DIR"]
        output_text = self.begin_daemon(VERGENCED, *CAMERAS, "store=none")
        self.assertIn(f"socket: {other}/state/vergence/vergenced.sock\n", output_text)
        self.assertIn(f"files: {self.home}/.local/share/vergence/files\n", output_text)
        self.assertNotIn("store:", output_text)
        # The daemon starts without the variable, the client has it.
        self.environment["XDG_RUNTIME_DIR"] = str(self.runtime)
        self.assert_answers("version")

    def test_the_directory_of_another_user_is_not_taken(self):
        self.environment["XDG_RUNTIME_DIR"] = "/no/such"
        self.assertIn(f"socket: {self.state}/", self.begin_daemon(VERGENCED, *CAMERAS))

    def test_settings_of_the_user(self):
        config = self.home / ".config" / "vergence" / "vergenced.conf"
        config.parent.mkdir(parents=True)
        config.write_text("".join(f"{line}\n" for line in (*CAMERAS, "queue = 3", "log = none")))
        output_text = self.begin_daemon(VERGENCED)
        self.assertIn(str(self.socket), output_text)
        self.assertFalse((self.state / "vergenced.log").exists())
        self.assertIn("queue: 3", self.assert_answers("config"))

    def test_directories_of_settings_are_not_created(self):
        done = self.run_as_user(VERGENCED, *CAMERAS, f"socket={self.folder}/slip/v.sock")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
        self.assertIn("No such file or directory", done.stderr)
        self.assertFalse((self.folder / "slip").exists())

    def test_a_directory_that_cannot_be_created_is_named(self):
        (self.home / ".local").write_text("in the way")
        done = self.run_as_user(VERGENCED, *CAMERAS)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
        self.assertIn(f"files = {self.home}/.local/share/vergence/files: ", done.stderr)

    def test_a_service_of_the_system_has_the_systems(self):
        for variable in ("RUNTIME_DIRECTORY", "STATE_DIRECTORY"):
            self.environment[variable] = "/run/vergence"
            output_text = self.run_as_user(VERGENCED, "--help-config").stdout
            del self.environment[variable]
            for line in ("socket = /run/vergence/vergenced.sock", "log = none",
                         "files = /var/lib/vergence/files", "store = /var/lib/vergence/store"):
                self.assertIn(f"\n{line}\n", output_text)
        self.assertIn(f"\nsocket = {self.socket}\n",
                      self.run_as_user(VERGENCED, "--help-config").stdout)

    def test_no_daemon_is_one_line_with_all_places(self):
        for words in ([], ["status"], ["--json", "status"]):
            done = self.ask(*words)
            output_text = json.loads(done.stdout)["message"] if "--json" in words else done.stderr
            self.assertEqual((done.returncode, (done.stdout + done.stderr).count("\n")), (3, 1))
            for word in (self.socket, self.state / "vergenced.sock",
                         "/run/vergence/vergenced.sock", "vergenced", "vergence simulate"):
                self.assertIn(str(word), output_text)

    def test_a_socket_that_was_left_behind(self):
        self.begin_daemon(VERGENCED, *CAMERAS)
        self.daemon.kill()
        self.daemon.wait(TIMEOUT_S)
        done = self.ask("status")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1))
        self.assertIn(f"{self.socket} (Connection refused)", done.stderr)

    def test_a_word_like_an_address_is_one(self):
        for word in ("rig.sock", "./rig", "localhost:4040", "udp:x"):
            done = self.ask(word, "status")
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn("unix:PATH", done.stderr)


@unittest.skipUnless(SIMRIG, "the simulated rig needs -DVERGENCE_FPGA=ON")
class Simulate(UserTest):
    def simulate(self, *words):
        """The printed lines to type next."""
        _, output_text = self.begin_until("--connect", VERGENCE, "simulate", "plane", *words)
        return [line.strip() for line in output_text.splitlines()[2:]]

    def check(self, *words):
        daemon, client = self.simulate(*words)
        self.begin_daemon("bash", "-c", f"cd / && exec {daemon}")
        done = self.run_as_user("bash", "-c", f"cd / && {client}", input="bringup\nquit\n")
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        self.assertIn("state: ready", done.stdout)

    def test_the_two_lines_work_as_they_are(self):
        self.check()

    def test_they_do_with_a_port(self):
        self.check("--listen", "tcp:0")

    def test_they_do_with_a_name_for_quotes(self):
        self.check("--listen", "unix:it's a rig.sock")


if __name__ == "__main__":
    unittest.main()
