# SPDX-License-Identifier: Apache-2.0
"""vergenced --check-board: what it finds on a fake kernel and on this machine, and its exit code."""
import json
import os
import subprocess
import tempfile
import unittest

from daemon_process import TIMEOUT_S, VERGENCED
from fake_devices import preloaded

BLOCK = 16384


class BoardCheck(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def check(self, *words, script=None):
        environment = os.environ
        if script is not None:
            path = os.path.join(self.folder, "script")
            with open(path, "w", encoding="ascii") as file:
                file.write(script)
            environment = preloaded(path)
        return subprocess.run([VERGENCED, "--check-board", *words], capture_output=True, text=True,
                              timeout=TIMEOUT_S, env=environment)

    def rows(self, *words, **options):
        """The rows by the name of their option, device, partition or variable; and the others."""
        done = self.check("--json", *words, **options)
        answer = json.loads(done.stdout)
        rows = {row["name"].split(" = ")[0]: row for row in answer["rows"]}
        missing = [name for name, row in rows.items() if row["state"] == "missing"]
        self.assertEqual(len(missing), answer["missing"])
        self.assertEqual((done.returncode, done.stderr), (1 if missing else 0, ""))
        return rows, missing

    def partition(self, name, data):
        path = os.path.join(self.folder, name)
        with open(path, "wb") as file:
            file.write(data)
        return f"mtd {name} {path} {BLOCK}\n"

    def environment(self, text, *options):
        """A partition with variables of U-Boot."""
        path = os.path.join(self.folder, "env")
        subprocess.run(["mkenvimage", "-s", str(BLOCK), *options, "-o", path, "-"], input=text,
                       text=True, check=True, capture_output=True)
        with open(path, "rb") as file:
            return self.partition("u-boot-env", file.read())

    def test_a_board_with_everything(self):
        devices = "i2c /dev/i2c-1 0x2c\nvideo /dev/video0 GREY PICTURE 100000\n"
        picture = os.path.join(self.folder, "picture")
        with open(picture, "wb") as file:
            file.write(b"P5 4 4 255\n" + bytes(16))
        for options in ((), ("-r",)):
            script = (devices.replace("PICTURE", picture) +
                      self.partition("image", b"\xff" * 4 * BLOCK) +
                      self.environment("bootcmd=run x\nx=boot\n", *options))
            rows, missing = self.rows("board=b", "image_slot=image", "rig.lenses=fixed",
                                      script=script)
            for name in ("i2c", "left_camera", "image_slot", "environment", "bootcmd",
                         "SECCOMP_FILTER", "UNIX", "INET", "PROC_FS"):
                self.assertEqual(rows[name]["state"], "there", rows[name])
            self.assertEqual(rows["bootcmd"]["found"], "run x")
            self.assertEqual(rows["image_slot"]["found"], "/dev/mtd0: 65536 bytes, erased by 16384")
            self.assertEqual(rows["board_args"]["state"], "not needed")
            # These the machine of the test need not have.
            self.assertLessEqual(set(missing), {"I2C_CHARDEV", "VIDEO_DEV", "JFFS2_FS",
                                                "MTD, MTD_CFI, MTD_PHYSMAP"})

    def test_what_is_missing(self):
        script = (self.partition("other", b"\xff" * BLOCK) +
                  self.partition("environment", b"\xff" * BLOCK))
        rows, missing = self.rows("board=b", "image_slot=image", "i2c=/dev/null",
                                  "left_camera=/etc/passwd", "lens_uart=/dev/none", script=script)
        for name, found in (("left_camera", "not a device"), ("lens_uart", "No such file"),
                            ("image_slot", 'no flash partition "image" in /proc/mtd (there are: '
                             'other environment)'),
                            ("environment", "/dev/mtd1: not an environment"), ("bootcmd", "")):
            self.assertIn(name, missing)
            self.assertIn(found, rows[name]["found"])
            self.assertGreater(len(rows[name]["if_missing"]), 10)
        done = self.check("board=b", "image_slot=image", script=script)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, r"(?m)^missing +partition +image_slot = image +images of ")
        self.assertRegex(done.stdout, r"(?m)^\d+ missing$")

    def test_nothing_is_needed(self):
        rows, missing = self.rows("backend=sim unix:rig.sock", "watchdog=none")
        self.assertEqual(missing, [])
        self.assertEqual(rows["image_slot"]["state"], "not needed")
        done = self.check("backend=sim unix:rig.sock")
        self.assertEqual((done.returncode, done.stdout.splitlines()[-1]), (0, "0 missing"))

    def test_wrong_words(self):
        done = self.check("board=")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)


if __name__ == "__main__":
    unittest.main()
