# SPDX-License-Identifier: Apache-2.0
"""`tools/package` of this build: lintian finds no error, and in a fresh Debian 12 the packages bring what they need,
and an ordinary user measures with them, or with the wheel. Requires root, mmdebstrap, and Debian's servers."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import time
import unittest

import cv2

from pairs import RECTIFIED, VERGENCE, make_pair

SOURCE = pathlib.Path(os.environ["VERGENCE_SOURCE"])
BUILD = pathlib.Path(VERGENCE).parents[1]
NAMES = ("libvergence-dev", "libvergence1", "python3-vergence", "vergence", "vergence-daemon", "vergence-simrig")
USER, HOME = "1000", "/srv/someone"

PROGRAM = r"""
#include <stdio.h>
#include <vergence.h>
int main(void) { puts(vergence_version()); return 0; }
"""


def call(*words, **options):
    done = subprocess.run([str(word) for word in words], text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, **options)
    if done.returncode != 0:
        raise AssertionError(f"{words}: {done.returncode}\n{done.stdout[-4000:]}")
    return done.stdout


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if os.geteuid() != 0 or not shutil.which("mmdebstrap"):
            raise unittest.SkipTest("requires root and mmdebstrap (tools/install_packages test)")
        if not (BUILD / "tools/simrig/simrig").exists():
            raise unittest.SkipTest("the simulated rig is not built (VERGENCE_FPGA)")
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vergence-packages-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.folder.chmod(0o755)
        cls.made = cls.folder / "made"
        printed = call(SOURCE / "tools/package", "--build", BUILD, "--out", cls.made, "deb")
        cls.packages = {path.name.split("_")[0]: path for path in cls.made.glob("*.deb")}
        assert sorted(printed.split()) == sorted(path.name for path in cls.packages.values()), printed
        cls.root = cls.folder / "root"
        call("mmdebstrap", "--mode=root", "--variant=apt",
             "--hook-dir=/usr/share/mmdebstrap/hooks/file-mirror-automount",
             *[f"--include={path}" for path in cls.packages.values()], "bookworm", cls.root)
        # Programs find their files from where they are.
        call("mount", "-t", "proc", "proc", cls.root / "proc")
        cls.addClassCleanup(call, "umount", cls.root / "proc")
        cls.home = cls.root / HOME.lstrip("/")
        cls.home.mkdir(parents=True)
        left, right, _ = make_pair()
        for name, image in (("left.png", left), ("right.png", right)):
            assert cv2.imwrite(str(cls.home / name), image)
        for path in (cls.home, *cls.home.iterdir()):
            os.chown(path, int(USER), int(USER))

    def words(self, *words):
        return ["chroot", f"--userspec={USER}:{USER}", str(self.root), "env", "-i", f"HOME={HOME}",
                "PATH=/usr/bin:/bin", "LC_ALL=C.UTF-8", "sh", "-c", 'cd && exec "$@"', "sh", *map(str, words)]

    def use(self, *words):
        return call(*self.words(*words))

    def test_the_packages_are_these_and_have_no_errors(self):
        self.assertEqual(tuple(sorted(self.packages)), NAMES)
        found = subprocess.run(["lintian", "--allow-root", "--fail-on", "error", "--tag-display-limit", "0",
                                *map(str, self.packages.values())], capture_output=True, text=True)
        self.assertEqual(found.returncode, 0, found.stdout + found.stderr)

    def test_the_version_is_the_same_everywhere(self):
        version = re.search(r"project\(vergence VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text())[1]
        self.assertIn(f"## {version}", (SOURCE / "CHANGELOG.md").read_text())
        for path in self.packages.values():
            self.assertRegex(call("dpkg-deb", "--field", path, "Version"), rf"^{re.escape(version)}(~git[0-9a-f.]+)?-1$")
        for program in ("vergence", "vergenced", "simrig"):
            self.assertIn(version, self.use(program, "--version"))
        self.assertIn(version, (self.root / "usr/lib").glob("**/vergence.pc").__next__().read_text())
        (self.folder / "user.c").write_text(PROGRAM)
        libraries = next((self.root / "usr/lib").glob("**/libvergence.so")).parent
        call("gcc", self.folder / "user.c", f"-I{self.root}/usr/include", f"-L{libraries}", "-lvergence",
             "-Wl,--allow-shlib-undefined", "-o", self.home / "user")
        self.assertIn(version, self.use("./user"))

    def test_the_python_package_is_the_system_s(self):
        result = json.loads(self.use("python3", "-c", """if True:
            import json, numpy, vergence as v
            s = v.reconstruct("left.png", "right.png", rectified=True, focal_px=500, baseline_mm=100, disparity=(0, 48))
            s.write("by_python", files=["disparity.pfm", "result.json"])
            print(json.dumps([v.__version__, v.__file__, len(s.points_mm)]))"""))
        self.assertEqual(result[1], "/usr/lib/python3/dist-packages/vergence/__init__.py")
        self.assertIn(f"Version: {result[0]}", call("dpkg-deb", "--field", self.packages["vergence"]))
        self.assertGreater(result[2], 10000)
        self.use("vergence", "reconstruct", "left.png", "right.png", *RECTIFIED, "--out", "by_program")
        self.assertEqual(*[(self.home / f"by_{one}/disparity.pfm").read_bytes() for one in ("python", "program")])

    def test_a_wheel_brings_its_libraries(self):
        name = call(SOURCE / "tools/package", "--build", BUILD, "--out", self.folder / "wheels", "wheel").strip()
        self.assertRegex(name, r"^vergence-[0-9.]+-cp3\d+-.*-manylinux_2_\d+_")
        unpacked = self.home / "wheel"
        shutil.unpack_archive(self.folder / "wheels" / name, unpacked, "zip")
        call("dpkg", "--root", self.root, "--remove", "--force-depends", "libvergence1")
        try:
            printed = self.use("env", f"PYTHONPATH={HOME}/wheel", "python3", "-c", """if True:
                import vergence as v
                s = v.reconstruct("left.png", "right.png", rectified=True, disparity=(0, 48))
                print(v.__file__, [line.split()[-1] for line in open("/proc/self/maps") if "libvergence" in line][0])""")
        finally:
            call("dpkg", "--root", self.root, "--install", self.packages["libvergence1"])
        self.assertEqual(printed.split()[0], f"{HOME}/wheel/vergence/__init__.py")
        self.assertIn(f"{HOME}/wheel/vergence.libs/libvergence", printed.split()[1])

    def test_a_tag_of_another_version_is_refused(self):
        clone = self.folder / "clone"
        call("git", "-c", "safe.directory=*", "clone", "--quiet", "--shared", SOURCE, clone)
        call("git", "-C", clone, "tag", "v9.9.9")
        done = subprocess.run([clone / "tools/package", "--build", BUILD, "--out", self.folder / "none", "deb"],
                              capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1), done.stderr)
        self.assertIn("the tag is v9.9.9", done.stderr)

    def test_the_service_has_its_user_and_settings(self):
        self.assertRegex((self.root / "etc/passwd").read_text(), r"(?m)^vergence:")
        self.assertIn("--config /etc/vergence/vergenced.conf",
                      (self.root / "usr/lib/systemd/system/vergenced.service").read_text())
        self.use("vergenced", "--check", "/etc/vergence/vergenced.conf")
        kept = call("chroot", self.root, "dpkg-query", "-W", "-f", "${Conffiles}", "vergence-daemon")
        self.assertEqual({line.split()[0] for line in kept.splitlines() if line.strip()},
                         {"/" + str(path.relative_to(self.root))
                          for path in (self.root / "etc/vergence").rglob("*") if path.is_file()})

    def test_a_user_measures_a_pair_and_a_session_of_the_simulated_rig(self):
        self.use("vergence", "reconstruct", "left.png", "right.png", *RECTIFIED, "--out", "result")
        self.assertGreater(json.loads((self.home / "result/result.json").read_text())["counts"]["vertices"], 10000)
        self.assertIn("vergence reconstruct", self.use("vergence", "help", "reconstruct"))
        started = []
        try:
            for words, socket in (
                    (("vergence", "simulate", "plane", "--listen", f"unix:{HOME}/rig.sock"), "rig.sock"),
                    (("vergenced", f"backend=sim unix:{HOME}/rig.sock", f"socket={HOME}/v.sock",
                      f"files={HOME}/files", f"store={HOME}/store", "log=none"), "v.sock")):
                started.append(subprocess.Popen(self.words(*words), stdout=subprocess.DEVNULL,
                                                stderr=subprocess.PIPE, text=True))
                while not (self.home / socket).exists():
                    if started[-1].poll() is not None:
                        self.fail(started[-1].stderr.read())
                    time.sleep(0.05)
            client = ("vergence", "--connect", f"unix:{HOME}/v.sock")
            for words in (("bringup",), ("autoexpose",), ("capture", "scene")):
                self.use(*client, *words)
        finally:
            for process in reversed(started):
                process.terminate()
                process.communicate()
        self.use("vergence", "reconstruct", "files/scene", "--all", "--rectified", "--scale", "0.25", "--keep-all",
                 "--out", "all")
        rows = json.loads((self.home / "all/pairs.json").read_text())["pairs"]
        self.assertEqual([row["result"] for row in rows], ["0001"])


if __name__ == "__main__":
    unittest.main()
