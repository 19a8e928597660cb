# SPDX-License-Identifier: Apache-2.0
"""tools/board with wrong words, on machines where something is missing, and with images that are not
right: one line that says what and what to do, and an exit code that is not 0."""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import unittest

from board_process import BOARD, BoardTest, board_command, child_of

# What U-Boot's script does with any image.
SCRIPT = "tftpboot 0x40400000 vergence.fit && bootm 0x40400000:kernel\n"
TREE = """/dts-v1/;
/ { description = "a test"; images { kernel { description = "none"; data = /incbin/("kernel");
    type = "kernel"; arch = "arm"; os = "linux"; compression = "none"; load = <0x41000000>;
    entry = <0x41000000>; hash-1 { algo = "sha256"; }; }; };
    configurations { default = "conf"; conf { kernel = "kernel"; }; }; };
"""
BYTES = 6 << 20
LIMIT_S = 120


def run(*words, path=None, **options):
    environment = {**os.environ, **({"PATH": path} if path else {})}
    return subprocess.run(board_command(*words, **options), stdin=subprocess.DEVNULL, text=True,
                          capture_output=True, timeout=LIMIT_S, env=environment, check=False)


class Words(unittest.TestCase):
    def test_help_names_every_option(self):
        done = subprocess.run([BOARD, "--help"], capture_output=True, text=True, check=True)
        source = pathlib.Path(BOARD).read_text(encoding="utf-8")
        options = re.search(r"^OPTIONS = \{(.*?)\}", source, re.M | re.S)[1]
        for option in re.findall(r'"(--[a-z]+)"', options):
            self.assertIn(f"\n  {option}", done.stdout)

    def test_wrong_words_are_one_line(self):
        for words in (["--what"], ["--scene"], ["--zoom", "far"], ["--zoom", "11x"], ["--seed", "-1"],
                      ["--port", "65536"], ["--network", "wifi"]):
            done = subprocess.run([BOARD, *words], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stdout), (2, ""), words)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)


class Bench(BoardTest):
    """Images are made here: none of them would start anything."""

    @classmethod
    def setUpClass(cls):
        cls.folder = cls.new_folder()
        cls.image = cls.folder / "image"
        cls.image.mkdir()
        for name, text in (("script", SCRIPT), ("tree.its", TREE)):
            (cls.folder / name).write_text(text, encoding="utf-8")
        # Six megabytes that no two places of are alike.
        (cls.folder / "kernel").write_bytes(b"".join(number.to_bytes(4, "big")
                                                     for number in range(BYTES // 4)))
        for command in ("mkimage -T script -A arm -C none -d script image/boot.scr",
                        "mkimage -f tree.its image/vergence.fit"):
            subprocess.run(command.split(), cwd=cls.folder, check=True, capture_output=True)
        cls.wrong = cls.new_folder() / "image"
        shutil.copytree(cls.image, cls.wrong)
        with open(cls.wrong / "vergence.fit", "r+b") as file:
            file.seek(BYTES // 2)
            byte = file.read(1)
            file.seek(-1, os.SEEK_CUR)
            file.write(bytes([byte[0] ^ 1]))

    def copy(self):
        folder = self.new_folder() / "image"
        shutil.copytree(self.image, folder)
        return folder

    def refused(self, done, *words):
        """The line on standard error; one, but for the progress."""
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        *progress, last = done.stderr.splitlines()
        self.assertTrue(all(line.startswith("board: ") for line in progress), done.stderr)
        self.assertTrue(last.startswith("tools/board: "), done.stderr)
        for word in words:
            self.assertIn(word, last)

    def test_a_missing_program_is_named(self):
        for missing in ("qemu-system-arm", "mkenvimage", "dnsmasq"):
            programs = self.new_folder()
            for folder in os.environ["PATH"].split(os.pathsep):
                for path in pathlib.Path(folder).glob("*"):
                    if path.name != missing and not (programs / path.name).exists():
                        (programs / path.name).symlink_to(path)
            words = ("--network", "tap") if missing == "dnsmasq" else ()
            done = run(*words, image_folder=self.image, path=str(programs))
            self.refused(done, missing, "tools/install_packages board")

    def test_no_tun_is_refused_or_done_without(self):
        """A user who may not open /dev/net/tun, as in many containers."""
        without = ["unshare", "--map-root-user", "--mount", "sh", "-ec",
                   'mount --bind /dev/null /dev/net/tun; exec "$@"', "sh"]
        for network, words in (("tap", ("/dev/net/tun", "--network user")),
                               ("auto", ("Bad Data Hash",))):
            done = subprocess.run([*without, *board_command("--network", network,
                                                            image_folder=self.wrong)],
                                  stdin=subprocess.DEVNULL, text=True, capture_output=True,
                                  timeout=LIMIT_S, check=False)
            self.refused(done, *words)
            self.assertEqual("QEMU's own DHCP and TFTP (no tap" in done.stderr, network == "auto",
                             done.stderr)

    def test_a_rig_that_is_not_there(self):
        for address in ("unix:none.sock", "tcp:1", "here"):
            self.refused(run("--rig", address, image_folder=self.image), "--rig", address)

    def test_a_scene_that_does_not_exist(self):
        for scene in ("moon", "none.yaml", "no/such"):
            done = run("--scene", scene, image_folder=self.image)
            self.refused(done, f"--scene {scene}: no such scene", "still_life")
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)  # nothing was begun

    def test_a_folder_without_an_image(self):
        self.refused(run(image_folder=self.folder), "vergence.fit", "no such file")
        folder = self.copy()
        (folder / "vergence.fit").write_bytes(b"no image at all")
        self.refused(run(image_folder=folder), "not a FIT image")
        whole = (self.image / "vergence.fit").read_bytes()
        (folder / "vergence.fit").write_bytes(whole[:len(whole) // 2])
        self.refused(run(image_folder=folder), "cut off", str(len(whole)))

    def test_one_wrong_byte_is_refused_by_u_boot(self):
        done = run(image_folder=self.wrong)
        self.refused(done, "U-Boot started no system", "Bad Data Hash")
        self.assertNotIn("Starting kernel", done.stdout)

    def test_a_server_that_dies_half_way(self):
        board = self.start("--network", "tap", image_folder=self.image)
        board.wait(r"vergence\.fit'[^#]*#{3}", LIMIT_S)
        os.kill(child_of(board.process, "dnsmasq"), signal.SIGKILL)
        self.assertEqual(board.wait_end(LIMIT_S), 1)
        self.assertNotIn("Starting kernel", board.text)
        self.assertIn("U-Boot started no system: Retry count exceeded", board.report())

    def test_a_rig_that_dies(self):
        board = self.start(image_folder=self.image)
        board.wait(r"vergence\.fit'[^#]*#{3}", LIMIT_S)
        os.kill(child_of(board.process, "simrig"), signal.SIGKILL)
        self.assertEqual(board.wait_end(LIMIT_S), 1)
        self.assertIn("tools/board: the simulated rig ended: killed by signal 9\n", board.report())

    def test_a_qemu_that_dies(self):
        board = self.start(image_folder=self.image)
        board.wait(r"vergence\.fit'[^#]*#{3}", LIMIT_S)
        os.kill(child_of(board.process, "qemu-system-arm"), signal.SIGKILL)
        self.assertEqual(board.wait_end(LIMIT_S), 1)
        self.assertIn("tools/board: QEMU ended: killed by signal 9\n", board.report())


if __name__ == "__main__":
    unittest.main()
