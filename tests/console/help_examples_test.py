# SPDX-License-Identifier: Apache-2.0
"""Every example of every --help runs as written, in a folder with the files that it names."""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import unittest

import cv2
import numpy

from as_user import AS_USER, VERGENCE, UserTest
from bad_line import BadLine
from daemon_process import TIMEOUT_S, SIMRIG, VERGENCED, Terminal

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
sys.path.insert(0, str(ROOT / "tests" / "command"))

import boards  # noqa: E402
from readme_test import write_calibration, write_pair  # noqa: E402
from recorded import Session  # noqa: E402

# Programs with help pages; vergence lists its own commands.
TOOLS = [str(path.relative_to(ROOT)) for folder in ("tools", "tools/simrig")
         for path in sorted((ROOT / folder).iterdir())
         if path.is_file() and os.access(path, os.X_OK)]
SERVES = re.compile(r"(vergence simulate|simrig(?!-)|vergenced)\b(?!.* --(view|replay|check)\b)")
# Devices that not every machine has, and their replacements in the test.
SERIAL = "/dev/ttyUSB0"
# Examples, or commands, that are not run, with the reason.
NOT_RUN = {"view": "serves a browser until it is ended: console/live_view_test"}


def page_of(*words):
    done = subprocess.run([*words, "--help"], capture_output=True, text=True, timeout=TIMEOUT_S,
                          check=True)
    return done.stdout


def examples_of(page):
    lines = page.partition("\nExamples\n")[2].split("\n\n")[0].splitlines()
    return [line.strip() for line in lines]


def commands():
    """The commands that vergence lists."""
    listed = page_of(VERGENCE).partition("\nCommands\n")[2].split("\n\n")[0]
    return [line.split()[0] for line in listed.splitlines()]


class Examples(UserTest):
    def setUp(self):
        super().setUp()
        programs = {os.path.dirname(program) for program in (VERGENCE, VERGENCED, SIMRIG)}
        self.environment["PATH"] = os.pathsep.join([*programs, os.environ["PATH"]])
        (self.home / "tools").symlink_to(ROOT / "tools")
        self.replaced = {}

    def place(self, *names):
        return self.home.joinpath(*names)

    def run_all(self, page):
        lines = examples_of(page)
        self.assertTrue(lines, "the page has no examples")
        for line in lines:
            if line in NOT_RUN:
                continue
            for device, instead in self.replaced.items():
                line = line.replace(device, instead)
            (self.serve if SERVES.match(line) else self.run_one)(line)

    def run_one(self, line):
        done = self.run_as_user("bash", "-c", line, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout}{done.stderr}")

    def serve(self, line):
        """Runs it until it reports that it is ready; then ends it."""
        program = subprocess.Popen([*AS_USER, "bash", "-c", "exec " + line], cwd=self.home,
                                   env=self.environment, stdin=subprocess.DEVNULL, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        output_text = []
        for reported in program.stdout:
            output_text.append(reported)
            if "listening on" in reported or "serving" in reported:
                program.send_signal(signal.SIGTERM)
        program.stdout.close()
        self.assertEqual(program.wait(TIMEOUT_S), 0, f"{line}\n{''.join(output_text)}")
        self.assertRegex("".join(output_text), "listening on|serving", line)

    def write_images(self):
        write_pair(self.home)
        write_calibration(self.home / "calibration")
        for name in ("intrinsics.yml", "extrinsics.yml"):
            shutil.copy(self.place("calibration", name), self.home)
        self.run_one("vergence info intrinsics.yml --size 640x480 --convert rig.txt")
        self.place("calibrated").mkdir()
        shutil.copy(self.place("rig.txt"), self.place("calibrated", "rig.calibration"))
        left = cv2.imread(str(self.place("left.png")), cv2.IMREAD_GRAYSCALE)
        right = cv2.imread(str(self.place("right.png")), cv2.IMREAD_GRAYSCALE)
        for name, image in (("im0.png", left), ("im1.png", right), ("l.pgm", left),
                            ("r.pgm", numpy.roll(right, -76, axis=1))):  # 600 mm away
            cv2.imwrite(str(self.place(name)), image)
        self.place("files").mkdir()
        Session(self.place("files", "scene")).pair(left, right)

    def start_rig(self, scene="plane"):
        self.begin_until("listening on", SIMRIG, "--scene", scene, "--files", ".", "--listen",
                         "unix:simrig.sock")

    # ---- programs without an instrument
    def test_reconstruct(self):
        self.write_images()
        self.run_all(page_of(VERGENCE, "reconstruct"))

    def test_measure(self):
        self.write_images()
        session = Session(self.place("cylinder"))
        session.calibration(self.place("rig.txt").read_bytes())
        images = [cv2.imread(str(self.place(f"{side}.png")), cv2.IMREAD_GRAYSCALE)
                  for side in ("left", "right")]
        session.pair(*images)
        session.note("# measure fit=300")
        session.note("# measure surface pair=1")
        session.end()
        self.run_all(page_of(VERGENCE, "measure"))

    def test_calibrate(self):
        made = boards.pairs(poses=boards.POSES[:8])
        boards.write(self.place("pictures"), made)
        boards.write(self.home, made, "left{:02d}.jpg", "right{:02d}.jpg")
        boards.write(self.home, made, "cam_a/{}.png", "cam_b/{}.png")
        names = "".join(f'"left{n:02d}.jpg"\n"right{n:02d}.jpg"\n' for n in range(1, 9))
        self.place("stereo_calib.xml").write_text(
            f'<?xml version="1.0"?>\n<opencv_storage>\n<imagelist>\n{names}</imagelist>\n'
            "</opencv_storage>\n")
        self.place("files").mkdir()
        for number, pair in enumerate(made, 1):
            Session(self.place("files", f"board-{number:02d}")).pair(*pair)
        coded = cv2.aruco.CharucoBoard_create(
            14, 10, 20, 15, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100))
        texture = coded.draw((14 * 60 + 60, 10 * 60 + 60), marginSize=30)
        boards.write(self.home, boards.pairs(texture=texture, poses=boards.POSES[:8], scale=2),
                     "left/{}.png", "right/{}.png")
        self.place("files/look").parent.mkdir(exist_ok=True)
        shutil.copytree(ROOT / "tests/data/zoom_capture", self.place("files/look"))
        self.write_zoom()
        self.run_all(page_of(VERGENCE, "calibrate"))

    def test_board(self):
        self.run_all(page_of(VERGENCE, "board"))

    def test_evaluate(self):
        self.write_images()
        self.run_one("vergence reconstruct im0.png im1.png --rectified --disparity 0:64 --out out")
        shutil.copy(self.place("truth.pfm"), self.place("disp0.pfm"))
        truth = cv2.imread(str(self.place("truth.pfm")), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(self.place("aloeGT.png")), truth.astype(numpy.uint8))
        cv2.imwrite(str(self.place("mask0nocc.png")), numpy.full(truth.shape, 255, numpy.uint8))
        self.run_all(page_of(VERGENCE, "evaluate"))

    def test_export(self):
        self.write_images()
        self.run_all(page_of(VERGENCE, "export"))

    def test_import(self):
        self.write_images()
        both = [cv2.imread(str(self.place(f"{side}.png"))) for side in ("left", "right")]
        cv2.imwrite(str(self.place("zed.png")), numpy.hstack(both))
        self.run_all(page_of(VERGENCE, "import"))

    def test_info(self):
        self.write_images()
        self.run_one("vergence reconstruct left.png right.png --calibration rig.txt --out results")
        self.write_zoom()
        self.run_all(page_of(VERGENCE, "info"))

    def write_zoom(self):
        self.place("instrument.zoom").write_bytes(subprocess.run(
            [os.environ["VERGENCE_ZOOM_RIG"]], capture_output=True, check=True).stdout)

    def test_every_command_has_examples_and_a_test(self):
        for command in commands():
            self.assertTrue(examples_of(page_of(VERGENCE, command)), command)
            self.assertTrue(command in NOT_RUN or hasattr(self, f"test_{command}"), command)
        # Those of tools/board boot a board: tests/board types such lines.
        self.assertEqual([tool for tool in TOOLS if "\nExamples\n" in page_of(ROOT / tool)],
                         ["tools/board", "tools/simrig/control"],
                         "a tool's examples that are not run here")

    # ---- with the simulated rig
    def need_rig(self):
        if not SIMRIG:
            self.skipTest("the simulated rig needs -DVERGENCE_FPGA=ON")

    def test_simulate(self):
        self.need_rig()
        self.run_all(page_of(VERGENCE, "simulate"))

    def test_simrig(self):
        self.need_rig()
        self.run_all(page_of(SIMRIG))

    def test_simrig_control(self):
        self.need_rig()
        self.start_rig("charuco")  # one has a board to move
        self.run_all(page_of(ROOT / "tools" / "simrig" / "control"))

    def test_vergenced(self):
        self.need_rig()
        self.start_rig()
        self.place("rig.sock").symlink_to("simrig.sock")
        self.run_one("vergenced --help-config > vergenced.conf")
        self.run_all(page_of(VERGENCED))

    def test_replay(self):
        self.need_rig()
        self.start_rig()
        self.begin_daemon("vergenced", "backend=sim unix:simrig.sock", "files=files")
        for command in ("record start r", "bringup", "window 64 48", "capture", "record stop"):
            self.assert_answers(*command.split())
        for name in re.findall(r"record-[\d-]+", page_of(VERGENCE, "replay")):
            shutil.copytree(self.place("files", "r"), self.place(name), dirs_exist_ok=True)
        self.run_all(page_of(VERGENCE, "replay"))

    def test_connect(self):
        console = Terminal()
        self.addCleanup(console.close)
        line = BadLine(console, seed=1, lost=0, changed=0)
        self.addCleanup(line.close)
        page = page_of(VERGENCE, "--connect")
        self.begin_daemon("vergenced", "profile=two-cameras", "left_camera=/dev/none1",
                          "right_camera=/dev/none2", f"console={console.name}", "files=files")
        self.place("rig.sock").symlink_to(self.socket)
        self.place("rig.txt").write_text("a file")
        for name in re.findall(r"fetch (\S+)", page):
            self.place("files", name).write_text("a report")
        self.replaced = {SERIAL: line.name}
        self.run_all(page)


if __name__ == "__main__":
    unittest.main()
