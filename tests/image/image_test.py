# SPDX-License-Identifier: Apache-2.0
"""tools/image: the same sources give the same bytes, the image holds what it should, and one that is
too large for the flash is refused."""
import hashlib
import lzma
import os
import pathlib
import re
import shutil
import stat
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
RESULTS = ["boot.scr", "kernel.uimage", "root.uimage", "vergence.fit"]
FIELDS = ("ino", "mode", "uid", "gid", "links", "time", "size", "major", "minor", "rmajor", "rminor",
          "namesize", "check")
SCRIPTS = ("init", "etc/vergence/serve", "etc/vergence/supervise", "etc/udhcpc.script")
# What the scripts call; what is part of the shell is not in BusyBox's list.
CALLED = {"cat", "chmod", "chown", "grep", "hostname", "init", "insmod", "ip", "mkdir", "mount", "rm",
          "sed", "sh", "start-stop-daemon", "sysctl", "tail", "tr", "udhcpc", "umount", "usleep"}


def run(*words, code=0, **options):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=800,
                          **options)
    if done.returncode != code:
        raise AssertionError(f"{words}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done


def image(*words, code=0):
    return run(ROOT / "tools" / "image", *words, code=code)


def members(archive):
    """Fields and content of each file of a cpio archive, by name."""
    found, at = {}, 0
    while True:
        assert archive[at:at + 6] == b"070701"
        fields = {name: int(archive[at + 6 + 8 * i:at + 14 + 8 * i], 16)
                  for i, name in enumerate(FIELDS)}
        start = at + 110
        name = archive[start:start + fields["namesize"] - 1].decode()
        data = (start + fields["namesize"] + 3) & ~3
        at = (data + fields["size"] + 3) & ~3
        if name == "TRAILER!!!":
            return found
        found[name] = (fields, archive[data:data + fields["size"]])


class Image(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vergence-image-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.first = cls.folder / "first"
        cls.report = image("--into", cls.first)
        for number, name in enumerate(("kernel", "ramdisk")):
            run("dumpimage", "-T", "flat_dt", "-p", number, "-o", cls.folder / name,
                cls.first / "vergence.fit")
        cls.files = members(lzma.decompress((cls.folder / "ramdisk").read_bytes()))

    def unpacked(self, name):
        """A file of the root file system, on this machine."""
        path = self.folder / pathlib.Path(name).name
        fields, data = self.files[name]
        path.write_bytes(data)
        path.chmod(stat.S_IMODE(fields["mode"]))
        return path

    def test_the_same_sources_give_the_same_bytes(self):
        second = self.folder / "second"
        self.assertEqual(image("--into", second).stdout, f"{second}\n")
        for name in RESULTS:
            self.assertEqual((self.first / name).read_bytes(), (second / name).read_bytes(), name)
        self.assertEqual(sorted(os.listdir(second)), RESULTS)

    def test_each_part_has_its_sum_and_its_weight_is_printed(self):
        fit = self.first / "vergence.fit"
        for part in ("kernel", "ramdisk"):
            data = (self.folder / part).read_bytes()
            stored = run("fdtget", "-t", "bx", fit, f"/images/{part}/hash-1", "value").stdout.split()
            self.assertEqual(bytes(int(byte, 16) for byte in stored), hashlib.sha256(data).digest())
            self.assertRegex(self.report.stderr, rf"(?m) {len(data)}\b")
        self.assertRegex(self.report.stderr, rf"(?m)^vergence.fit +{fit.stat().st_size} ")
        date = run("git", "-c", "safe.directory=*", "-C", ROOT, "log", "-1", "--format=%ct").stdout
        self.assertEqual(run("fdtget", fit, "/", "timestamp").stdout, date)
        self.assertEqual(run("fdtget", fit, "/", "board").stdout, "vergence-virt\n")

    def test_the_image_is_as_small_as_promised(self):
        self.assertLessEqual((self.first / "vergence.fit").stat().st_size, 3_200_000)
        self.assertLessEqual((self.folder / "ramdisk").stat().st_size, 1_300_000)
        readme = (ROOT / "firmware" / "system" / "README.md").read_text()
        for name, path in (("kernel", self.folder / "kernel"), ("root file system", self.folder / "ramdisk"),
                           ("vergence.fit", self.first / "vergence.fit")):
            promised = float(re.search(rf"^\| {name} \| ([0-9.]+) \|$", readme, re.M)[1])
            self.assertLessEqual(path.stat().st_size / 1e6, promised * 1.03, name)

    def test_linux_gets_the_same_words_wherever_it_comes_from(self):
        """From flash, over TFTP and in the old format; each must start without the others."""
        words = {re.findall(r"setenv bootargs ([^;\n]*)", (ROOT / "firmware/system" / name).read_text())[0]
                 for name in ("environment.txt", "boot.cmd", "README.md")}
        self.assertEqual(len(words), 1, words)

    def test_the_commands_of_the_readme_run(self):
        readme = (ROOT / "firmware" / "system" / "README.md").read_text()
        commands = re.search(r"^```sh\n(.*?)^```", readme, re.M | re.S)[1]
        shown = run("bash", "-euc", commands, cwd=ROOT).stdout.split()
        self.assertEqual(set(RESULTS) - set(shown), set())

    def test_the_old_format_holds_the_same_parts(self):
        for kind, part in (("kernel", "kernel"), ("ramdisk", "root")):
            run("dumpimage", "-T", kind, "-o", self.folder / "old", self.first / f"{part}.uimage")
            self.assertEqual((self.folder / "old").read_bytes(), (self.folder / kind).read_bytes(), part)

    def test_the_root_file_system_holds_what_it_should(self):
        for name in (*SCRIPTS, "bin/busybox", "bin/vergenced", "bin/vergence"):
            self.assertEqual(self.files[name][0]["mode"], stat.S_IFREG | 0o755, name)
        for name in ("etc/passwd", "etc/group", "etc/sysctl.conf", "etc/vergence/vergenced.conf"):
            self.assertEqual(self.files[name][0]["mode"], stat.S_IFREG | 0o644, name)
        console = self.files["dev/console"][0]
        self.assertEqual((console["mode"], console["rmajor"], console["rminor"]),
                         (stat.S_IFCHR | 0o600, 5, 1))
        self.assertEqual(self.files["bin/sh"][1], b"busybox")
        self.assertEqual({(fields["uid"], fields["gid"]) for fields, _ in self.files.values()}, {(0, 0)})
        self.assertIn(b"\nvergence:x:100:100:", self.files["etc/passwd"][1])

    def test_the_programs_run_without_libraries_and_accept_the_settings(self):
        for name in ("busybox", "vergenced", "vergence"):
            self.assertNotIn("INTERP", run("readelf", "-lW", self.unpacked(f"bin/{name}")).stdout)
        settings = self.unpacked("etc/vergence/vergenced.conf")
        done = run("qemu-arm", self.folder / "vergenced", "--check", settings)
        self.assertEqual(done.stdout, f"{settings}: good\n")
        board = run("fdtget", self.first / "vergence.fit", "/", "board").stdout.strip()
        self.assertIn(f"\nboard = {board}\n", settings.read_text())

    def test_the_scripts_call_what_busybox_has(self):
        busybox = self.unpacked("bin/busybox")
        applets = set(run("qemu-arm", busybox, "--list").stdout.split())
        self.assertEqual(CALLED - applets, set())
        for name in SCRIPTS:
            run("qemu-arm", busybox, "sh", "-n", self.unpacked(name))

    def test_one_that_is_too_large_is_refused_and_the_last_one_stays(self):
        into = self.folder / "kept"
        shutil.copytree(self.first, into)
        (into / "vergence.fit").write_bytes(b"the last one")
        done = image("--into", into, "--limit", "1000000", code=1)
        self.assertEqual(done.stdout, "")
        self.assertRegex(done.stderr.splitlines()[-1], r"^tools/image: vergence.fit is \d+ bytes too large "
                                                       r"for its 1000000 bytes of flash$")
        self.assertEqual((into / "vergence.fit").read_bytes(), b"the last one")
        self.assertEqual(sorted(os.listdir(into)), RESULTS)

    def test_an_option_that_does_not_exist_is_reported(self):
        """The configuration would drop it silently."""
        tree = self.folder / "tree"
        shutil.copytree(ROOT / "tools" / "system", tree / "tools" / "system")
        shutil.copytree(ROOT / "firmware" / "system", tree / "firmware" / "system")
        with open(tree / "firmware" / "system" / "busybox.cfg", "a", encoding="utf-8") as options:
            options.write("CONFIG_NO_SUCH_THING=y\n")
        libraries = run(ROOT / "tools" / "cross.d" / "unpack_libraries", "armhf",
                        "arm-linux-gnueabihf").stdout.strip()
        done = run(tree / "tools" / "system" / "build_busybox", f"{libraries}/usr/src/busybox", code=1,
                   env={**os.environ, "XDG_CACHE_HOME": str(self.folder / "cache")})
        self.assertEqual(done.stderr, "tools/image: options of busybox.cfg that BusyBox does not take: "
                                      "CONFIG_NO_SUCH_THING=y\n")

    def test_wrong_usage_is_one_line(self):
        for words in (("--limit",), ("--limit", "much"), ("--jobs", "0"), ("here",), ("--into",)):
            done = image(*words, code=2)
            self.assertEqual((done.stdout, done.stderr.count("\n")), ("", 1), words)


if __name__ == "__main__":
    unittest.main()
