# SPDX-License-Identifier: Apache-2.0
"""A user without root privileges, with a separate home directory."""
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import unittest

from daemon_process import TIMEOUT_S

VERGENCE = os.environ["VERGENCE"]
# Builds and sources may be readable only by root: a namespace keeps that, and drops root.
AS_USER = ("unshare", "--user", "--map-user=1000", "--map-group=1000") if os.geteuid() == 0 else ()


class UserTest(unittest.TestCase):
    def setUp(self):
        if AS_USER and subprocess.run([*AS_USER, "true"], check=False,
                                      stderr=subprocess.DEVNULL).returncode != 0:
            self.skipTest("the system lets root not become a user (unshare --user)")
        # Socket names must be short: not in the build folder.
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="places"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.home, self.runtime = self.folder / "home", self.folder / "run"
        self.home.mkdir()
        self.runtime.mkdir(mode=0o700)
        self.state = self.home / ".local" / "state" / "vergence"
        self.socket = self.runtime / "vergence" / "vergenced.sock"
        self.environment = {name: value for name, value in os.environ.items()
                            if not name.startswith("XDG_") and not name.endswith("_DIRECTORY")}
        # The leak check needs another process, which a confined daemon may not create.
        self.environment |= {"HOME": str(self.home), "XDG_RUNTIME_DIR": str(self.runtime),
                             "ASAN_OPTIONS": "detect_leaks=0"}

    def begin(self, *command, **options):
        """Runs a program in the background and ends it orderly."""
        program = subprocess.Popen([*AS_USER, *command], cwd=self.home, env=self.environment,
                                   stdin=subprocess.DEVNULL, text=True, **options)

        def end():
            program.send_signal(signal.SIGTERM)
            program.wait(TIMEOUT_S)
            for stream in (program.stdout, program.stderr):
                if stream:
                    stream.close()
        self.addCleanup(end)
        return program

    def begin_until(self, word, *command):
        """Starts a program in the background and returns its output up to the line with this
        word."""
        program = self.begin(*command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        output_text = []
        for line in program.stdout:
            output_text.append(line)
            if word in line:
                return program, "".join(output_text)
        raise AssertionError(f"it has ended: {output_text}")

    def begin_daemon(self, *command):
        """Its output until it serves."""
        self.daemon, output_text = self.begin_until("serving", *command)
        return output_text

    def run_as_user(self, *command, **options):
        return subprocess.run([*AS_USER, *command], cwd=self.home, env=self.environment, text=True,
                              capture_output=True, timeout=8 * TIMEOUT_S, check=False, **options)

    def ask(self, *words, **options):
        return self.run_as_user(VERGENCE, "--connect", *words, **options)

    def assert_answers(self, *words):
        done = self.ask(*words)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        return done.stdout
