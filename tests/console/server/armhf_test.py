# SPDX-License-Identifier: Apache-2.0
"""The console on 32-bit ARM: what the emulated board (tests/board), which runs the same programs, does not
show: confinement, settings and sockets, the client, and a replay. The programs are those that tools/cross
builds, run by qemu's user-mode emulation; the simulated rig is the host's."""
import atexit
import os
import re
import subprocess
import tempfile
import unittest

ROOT = os.environ["VERGENCE_SOURCE"]
HOST_CLIENT = os.environ["VERGENCE_BOARD"]
BUILD_TIMEOUT_S = 1200
# What is run again; the host's client asks, so that bytes from both processors are compared.
CORE = (
    "start_test.Unconfined", "start_test.LogFile", "start_test.SettingsFile",
    "start_test.NoRig", "start_test.NoSocket.test_a_port_that_is_taken",
    "rig_test.Rig.test_a_recorded_session_replays_identically",
)
# The emulator has no seccomp.
LAUNCHER = """#!/bin/sh
case " $* " in
    *" confine="*) exec qemu-arm {program} "$@" ;;
    *) exec qemu-arm {program} "$@" confine=no ;;
esac
"""


# The host's programs may be of another commit.
BUILD = re.compile(rb" build [0-9a-f]+(-dirty)?")


def build():
    """The folder of the programs."""
    done = subprocess.run([os.path.join(ROOT, "tools", "cross"), "armhf"], text=True,
                          capture_output=True, timeout=BUILD_TIMEOUT_S)
    if done.returncode != 0:
        raise RuntimeError(f"tools/cross armhf: {done.stderr}")
    return done.stdout.strip()


PROGRAMS = build()
CLIENT = os.path.join(PROGRAMS, "vergence")
launchers = tempfile.TemporaryDirectory(prefix="armhf")
atexit.register(launchers.cleanup)
launcher = os.path.join(launchers.name, "vergenced")
with open(launcher, "w", encoding="ascii") as file:
    file.write(LAUNCHER.format(program=os.path.join(PROGRAMS, "vergenced")))
os.chmod(launcher, 0o755)
# The other modules read it when they are imported.
os.environ["VERGENCED"] = launcher

from daemon_process import TIMEOUT_S, DaemonTest  # noqa: E402


def files_below(folder):
    found = {}
    for place, _, names in os.walk(folder):
        for name in names:
            with open(os.path.join(place, name), "rb") as file:
                found[os.path.relpath(os.path.join(place, name), folder)] = \
                    BUILD.sub(b"", file.read())
    return found


class Programs(unittest.TestCase):
    def test_they_need_no_library_and_are_stripped(self):
        for name in ("vergenced", "vergence"):
            done = subprocess.run(["readelf", "-hlS", os.path.join(PROGRAMS, name)], text=True,
                                  check=True, capture_output=True)
            self.assertRegex(done.stdout, r"Class: +ELF32\n")
            self.assertRegex(done.stdout, r"Machine: +ARM\n")
            self.assertNotRegex(done.stdout, r"INTERP|\.symtab")

    def test_the_daemon_confines_itself(self):
        """Built with libseccomp, whose filter the emulator refuses."""
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                ["qemu-arm", os.path.join(PROGRAMS, "vergenced"),
                 f"backend=replay {ROOT}/tests/sessions/small", f"socket={folder}/s", "files=none",
                 "store=none"], capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("confinement: refused by the system", done.stderr)

    def test_the_client_s_surface_is_the_host_s(self):
        session = os.path.join(os.environ["VERGENCE_SESSIONS"], "cylinder_1x")
        with tempfile.TemporaryDirectory() as folder:
            for name, *program in (("arm", "qemu-arm", CLIENT), ("host", HOST_CLIENT)):
                done = subprocess.run([*program, "reconstruct", session, "--near", "1600", "--far",
                                       "2300", "--out", os.path.join(folder, name)],
                                      capture_output=True, text=True, timeout=2 * TIMEOUT_S)
                self.assertEqual(done.returncode, 0, done.stderr)
            done = subprocess.run([HOST_CLIENT, "reconstruct", os.path.join(folder, "arm/surface.compact"), "--out",
                                   os.path.join(folder, "again")], capture_output=True, text=True,
                                  timeout=TIMEOUT_S)
            self.assertEqual(done.returncode, 0, done.stderr)
            again = files_below(os.path.join(folder, "again"))
            surfaces = [files_below(os.path.join(folder, name)) for name in ("arm", "host")]
        self.assertEqual(set(surfaces[0]), set(surfaces[1]))
        self.assertIn("disparity.pfm", surfaces[0])
        for name in set(surfaces[0]) - {"surface.compact", "result.json"}:  # which have times
            self.assertTrue(surfaces[0][name] == surfaces[1][name], name)
            self.assertTrue(surfaces[0][name] == again[name], name)


class Client(DaemonTest):
    def vergence_on_arm(self, *words):
        done = subprocess.run(["qemu-arm", CLIENT, "--connect", f"unix:{self.path}", *words],
                              capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual((done.returncode, done.stderr), (0, ""), words)
        return done.stdout

    def test_it_asks_and_carries_files(self):
        self.assertIn("state: ready", self.vergence_on_arm("bringup"))
        self.vergence_on_arm("window", "64", "48")
        self.vergence_on_arm("capture", "p")
        copy = os.path.join(self.folder, "copy")
        self.vergence_on_arm("fetch", "p", copy)
        self.assertEqual(files_below(copy), files_below(os.path.join(self.files, "p")))
        with open(os.path.join(self.folder, "sent"), "wb") as file:
            file.write(os.urandom(1 << 20))
        self.vergence_on_arm("send", file.name, "sent")
        with open(file.name, "rb") as one, open(os.path.join(self.files, "sent"), "rb") as other:
            self.assertEqual(one.read(), other.read())


def load_tests(loader, own, _):
    return unittest.TestSuite([own, loader.loadTestsFromNames(CORE)])


if __name__ == "__main__":
    unittest.main()
