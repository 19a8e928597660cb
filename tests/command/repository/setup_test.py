# SPDX-License-Identifier: Apache-2.0
"""tools/install_packages and tools/opencv_samples on machines with missing packages.

The machine is simulated by small programs, earlier in PATH than the real ones, that record their
calls.
"""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.environ["VERGENCE_SOURCE"]
# The programs that the scripts need from the real machine.
REAL = ("bash", "env", "sort", "comm", "sed", "mkdir", "mktemp", "rm", "mv", "cat", "tail", "touch",
        "dirname")
PICTURES = ("aloeL.jpg", "aloeR.jpg", "aloeGT.png", "left01.jpg", "right01.jpg")
INSIDE = "usr/share/doc/opencv-doc/examples/data"
WRITE_DOWN = 'echo "$(basename "$0") $*" >>"$CALLS"\n'


class Setup(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vergence-setup-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.programs = self.folder / "bin"
        self.programs.mkdir()
        for name in (*REAL, "basename"):
            (self.programs / name).symlink_to(shutil.which(name))
        self.calls = self.folder / "calls"
        self.calls.touch()
        self.system = self.folder / "system"

    def play(self, name, script):
        path = self.programs / name
        path.write_text("#!/bin/bash\n" + script)
        path.chmod(0o755)

    def run_tool(self, tool, *arguments):
        # `id` and `nproc` come from here, too: only what setUp and the test put there.
        return subprocess.run([os.path.join(ROOT, "tools", tool), *arguments], capture_output=True,
                              text=True, timeout=60, env={
                                  "PATH": str(self.programs), "HOME": str(self.folder / "home"),
                                  "CALLS": str(self.calls), "VERGENCE_RETRY_WAIT_S": "0",
                                  "VERGENCE_SYSTEM_ROOT": str(self.system)})

    def called(self):
        return self.calls.read_text().splitlines()


    def installed(self, *missing):
        """Simulates a machine where all packages but these are installed."""
        words = " ".join(missing)
        self.play("dpkg-query", f'for p in "${{@:4}}"; do case " {words} " in *" $p "*) ;; '
                                '*) echo "$p installed" ;; esac; done\n')

    def user(self, number):
        self.play("id", f"echo {number}\n")

    def test_nothing_missing_calls_nothing(self):
        self.installed()
        self.user(1000)
        for name in ("apt-get", "sudo"):
            self.play(name, WRITE_DOWN)
        for group in ("demo", "bench"):
            done = self.run_tool("install_packages", group)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        self.assertEqual(self.called(), [])

    def test_a_user_asks_sudo_for_what_is_missing(self):
        self.installed("ccache", "python3-pip")
        self.user(1000)
        self.play("apt-get", WRITE_DOWN)
        self.play("sudo", WRITE_DOWN + '"$@"\n')
        done = self.run_tool("install_packages")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (0, 1), done.stderr)
        installs = [call for call in self.called() if call.startswith("apt-get install")]
        self.assertEqual(len(installs), 1)
        self.assertEqual(installs[0].split()[-2:], ["ccache", "python3-pip"])
        self.assertTrue(any(call.startswith("sudo env") for call in self.called()))

    def test_root_needs_no_sudo(self):
        self.installed("ccache")
        self.user(0)
        self.play("apt-get", WRITE_DOWN)
        self.assertEqual(self.run_tool("install_packages").returncode, 0)
        self.assertTrue(all(call.startswith("apt-get") for call in self.called()))

    def test_without_rights_it_reports_what_to_install(self):
        self.installed("ccache", "cmake")
        self.user(1000)
        self.play("apt-get", WRITE_DOWN)
        done = self.run_tool("install_packages")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
        self.assertIn("ccache cmake", done.stderr)
        self.assertEqual(self.called(), [])

    def test_another_system_hears_what_is_needed(self):
        self.user(0)
        done = self.run_tool("install_packages")  # neither dpkg-query nor apt-get
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
        self.assertIn("apt-get", done.stderr)
        self.assertIn("cmake", done.stderr)

    def test_a_failed_installation_is_reported(self):
        self.installed("ccache")
        self.user(0)
        self.play("apt-get", '[ "$1" = update ]\n')
        done = self.run_tool("install_packages")
        self.assertEqual(done.returncode, 1)
        self.assertIn("could not install: ccache", done.stderr)

    def fail_first(self, name, times, complaint, then=""):
        """Plays a program that fails for so many calls: a lock is held, a server does not answer."""
        self.play(name, WRITE_DOWN + f'[ "$(grep -c "^{name} $1" "$CALLS")" -gt {times} ] || '
                                     f'{{ echo "E: {complaint}" >&2; exit 100; }}\n{then}')
        (self.programs / "grep").exists() or \
            (self.programs / "grep").symlink_to(shutil.which("grep"))

    def test_a_held_lock_is_waited_for(self):
        self.installed("ccache")
        self.user(0)
        self.fail_first("apt-get", 2, "Could not get lock /var/lib/dpkg/lock-frontend")
        done = self.run_tool("install_packages")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("Could not get lock", done.stderr)
        for what in ("update", "install"):
            calls = [call for call in self.called() if call.startswith(f"apt-get {what}")]
            self.assertEqual(len(calls), 3)
            self.assertTrue(all("DPkg::Lock::Timeout=" in call and "Acquire::Retries=" in call
                                for call in calls), calls)

    def test_a_lock_that_is_never_released_fails(self):
        self.installed("ccache")
        self.user(0)
        self.fail_first("apt-get", 99, "Could not get lock /var/lib/dpkg/lock-frontend")
        done = self.run_tool("install_packages")
        self.assertEqual(done.returncode, 1)
        self.assertIn("could not install: ccache", done.stderr)
        self.assertEqual(len(self.called()), 6)

    def test_a_failed_download_is_tried_again(self):
        names = " ".join(PICTURES)
        self.fail_first("apt-get", 1, "Failed to fetch", "touch opencv-doc_1_all.deb\n")
        self.play("dpkg-deb", f'mkdir -p "$3/{INSIDE}" && cd "$3/{INSIDE}" && touch {names}\n')
        done = self.run_tool("opencv_samples")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((pathlib.Path(done.stdout.strip()) / "aloeL.jpg").is_file())
        self.assertEqual(len(self.called()), 2)

    def put_pictures(self, folder):
        (folder / INSIDE).mkdir(parents=True)
        for name in PICTURES:
            (folder / INSIDE / name).touch()

    def test_pictures_of_the_system_come_first(self):
        self.put_pictures(self.system)
        done = self.run_tool("opencv_samples")
        self.assertEqual((done.returncode, done.stdout, done.stderr),
                         (0, f"{self.system}/{INSIDE}\n", ""))

    def test_pictures_left_out_are_unpacked_once(self):
        (self.system / INSIDE).mkdir(parents=True)
        self.play("apt-get", WRITE_DOWN + "touch opencv-doc_1_all.deb\n")
        names = " ".join(PICTURES)
        self.play("dpkg-deb", WRITE_DOWN + f'mkdir -p "$3/{INSIDE}" && cd "$3/{INSIDE}" && '
                                           f"touch {names}\n")
        first, second = (self.run_tool("opencv_samples") for _ in range(2))
        self.assertEqual((first.returncode, first.stderr.count("\n")), (0, 1), first.stderr)
        self.assertIn("/usr/share/doc", first.stderr)
        self.assertTrue((pathlib.Path(first.stdout.strip()) / "aloeL.jpg").is_file())
        self.assertEqual((second.stdout, second.stderr), (first.stdout, ""))
        self.assertEqual(len(self.called()), 2)

    def test_a_failed_download_leaves_nothing(self):
        self.play("apt-get", "echo 'E: Unable to locate package opencv-doc'; exit 100\n")
        done = self.run_tool("opencv_samples")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("Unable to locate", done.stderr)
        self.assertIn("apt-get update", done.stderr)
        self.assertEqual([p for p in self.folder.rglob("unpack.*")], [])


if __name__ == "__main__":
    unittest.main()
