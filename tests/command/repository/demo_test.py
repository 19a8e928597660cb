# SPDX-License-Identifier: Apache-2.0
"""tools/demo and tools/install_packages as a newcomer runs them."""
import json
import os
import pty
import re
import subprocess
import tempfile
import unittest

ROOT = os.environ["VERGENCE_SOURCE"]


def run(tool, *arguments, **environment):
    return subprocess.run([os.path.join(ROOT, "tools", tool), *arguments], capture_output=True,
                          text=True, timeout=1800, env={**os.environ, **environment})


def load(*parts):
    with open(os.path.join(*parts), encoding="utf-8") as file:
        return json.load(file)


class Usage(unittest.TestCase):
    def test_wrong_usage(self):
        for tool in ("build", "demo", "figures", "install_packages"):
            wrong = run(tool, "--no-such-thing")
            self.assertEqual((wrong.returncode, wrong.stdout), (2, ""))
            self.assertEqual(wrong.stderr.count("\n"), 1)
            self.assertEqual(run(tool, "--help").returncode, 0)

    def test_jobs_require_a_number(self):
        for tool in ("bfin-toolchain", "build", "campaign fuzz", "cross", "cross.d/build_fdpic",
                     "cross.d/build_kernel_nommu", "cross.d/build_libraries", "image", "package",
                     "system/build_busybox", "system/build_kernel", "test"):
            for number in ((), ("x",), ("0",)):
                wrong = run(*tool.split(), "--jobs", *number)
                self.assertEqual((wrong.returncode, wrong.stdout), (2, ""), (tool, number))
                self.assertRegex(wrong.stderr, r"^tools/[\w-]+: --jobs (requires|needs) a .*number.*\n$", (tool, number))

    def test_what_only_takes_is_known_before_a_build(self):
        for only in ("no_such_thing", "["):
            wrong = run("campaign", "experiments", "--only", only)
            self.assertEqual((wrong.returncode, wrong.stdout), (2, ""), only)
            self.assertRegex(wrong.stderr, "^experiments.py: .*--only.*\n$", only)

    def test_figures_are_listed_and_chosen(self):
        names = run("figures", "--list").stdout.split()
        for name in ("cylinder_1000", "cylinder_360", "mug_250", "figurine_180", "level_150"):
            self.assertIn(name, names)
        self.assertEqual(run("figures", "--list", "--only", "mug_.*").stdout.split(), ["mug_600", "mug_250"])
        for wrong in (("--only", "mug"), ("--only", "("), ("--jobs", "0"), ("--only", "mug_.*", "--document", "page")):
            done = run("figures", "--list", *wrong)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (2, "", 1), wrong)


class Demo(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="vergence-demo-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.first = run("demo", "--out", cls.folder.name)

    def test_reports_where_to_look(self):
        self.assertEqual(self.first.returncode, 0, self.first.stdout + self.first.stderr)
        for name in ("motorcycle", "aloe", "chessboard", "rig_cylinder"):
            report = os.path.join(self.folder.name, name, "report.html")
            self.assertIn(report, self.first.stdout)
            self.assertGreater(os.path.getsize(report), 100_000)
            self.assertLess(os.path.getsize(report), 8_000_000)
        self.assertTrue(all(len(line) <= 120 for line in self.first.stdout.splitlines()))

    def test_motorcycle_is_where_the_truth_reports(self):
        score = load(self.folder.name, "motorcycle", "evaluation.json")
        self.assertLess(score["measured_all"]["bad_2_percent"], 6)
        self.assertGreater(score["measured_all"]["density_percent"], 70)
        result = load(self.folder.name, "motorcycle", "result.json")
        self.assertTrue(result["metric"])
        # The truth has disparities of 7.2 to 59.9 px: f B / (d + doffs).
        near, far = (994.978 * 193.001 / (d + 31.086) for d in (59.9, 7.2))
        self.assertGreater(result["bounds_mm"]["min"][2], 0.85 * near)
        self.assertLess(result["bounds_mm"]["max"][2], 1.25 * far)

    def test_aloe_reports_what_is_assumed(self):
        score = load(self.folder.name, "aloe", "evaluation.json")
        self.assertLess(score["measured_all"]["bad_2_percent"], 5)
        with open(os.path.join(self.folder.name, "aloe", "report.html"), encoding="utf-8") as file:
            self.assertIn("cropped by 270 px", file.read())

    def test_chessboard_has_its_true_size(self):
        board = load(self.folder.name, "chessboard", "board.json")
        self.assertAlmostEqual(board["square_mm"], board["true_square_mm"], delta=0.2)
        self.assertLess(board["plane_rms_mm"], 1.0)
        self.assertLess(board["off_plane"], 0.1 * board["corners"])
        self.assertFalse(load(self.folder.name, "chessboard", "result.json")["plan"]["identity"])
        calibration = load(self.folder.name, "chessboard-calibration", "calibration.json")
        self.assertTrue(calibration["verdict"]["good"])
        self.assertAlmostEqual(calibration["rig"]["baseline_mm"], 99.80, delta=0.10)
        page = os.path.join(self.folder.name, "chessboard-calibration", "calibration.html")
        self.assertIn(page, self.first.stdout)
        self.assertGreater(os.path.getsize(page), 100_000)

    def test_one_command_measures_what_is_in_front_of_the_simulated_rig(self):
        folder = os.path.join(self.folder.name, "rig_cylinder")
        found = load(folder, "measured.json")
        texture = found["visible_textured"]
        self.assertGreater(texture["pixels"], 100_000)
        self.assertGreaterEqual(texture["measured_percent"], 95)
        self.assertLessEqual(texture["fit"]["median_error_px"], 0.2)
        self.assertLessEqual(found["visible"]["fit"]["wrong_3px_percent"], 1)
        self.assertLess(abs(found["common"]["ratio"]), 4)
        with open(os.path.join(folder, "console.txt"), encoding="utf-8") as file:
            console = file.read()
        self.assertTrue(console.startswith("> measure cylinder --fit 360\n"))
        self.assertIn("points good to", console)

    def test_the_calibration_of_all_zooms_holds_at_others(self):
        folder = os.path.join(self.folder.name, "zoom-calibration")
        found = load(folder, "verify.json")
        self.assertTrue(found["verdict"]["good"])
        calibrated = [setting["zoom_counts"]
                      for setting in load(folder, "calibration.json")["left"]["settings"]]
        self.assertEqual(len(found["verify"]), 2)
        for look in found["verify"]:
            self.assertGreater(min(abs(look["zoom"] - zoom) for zoom in calibrated), 5)
            self.assertLess(look["read"]["rows_z"], 4)
            self.assertLess(look["refined"]["rows_px"], 0.1)
            self.assertLess(look["refined"]["square_z"], 4)
            self.assertLess(look["refined"]["depth_sigma_mm"], look["read"]["depth_sigma_mm"] / 2)
        page = os.path.join(folder, "calibration.html")
        self.assertIn(page, self.first.stdout)
        with open(page, encoding="utf-8") as file:
            text = file.read()
        for words in ("Focal length against zoom position", "Verified at zooms"):
            self.assertIn(words, text)

    def test_second_run_does_no_needless_work(self):
        second = run("demo", "--quick", "--out", os.path.join(self.folder.name, "second"))
        self.assertEqual(second.returncode, 0, second.stderr)
        self.assertNotRegex(second.stdout + second.stderr, "installing [0-9]|downloading")
        build = run("build", "--where", "demo").stdout.rstrip("\n")
        with open(os.path.join(build, "build.log"), encoding="utf-8") as file:
            compiled = re.findall(r"Building \S+ object", file.read())
        self.assertEqual(compiled, [])

    def test_a_build_that_fails_reports_where(self):
        with tempfile.TemporaryDirectory(prefix="vergence-build-") as folder:
            done = run("build", "some/part", "-DCMAKE_C_COMPILER=/no/such", XDG_CACHE_HOME=folder)
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            place = re.search(r"log: (\S+)\n$", done.stderr).group(1)
            self.assertRegex(place, folder + r"/vergence/some/[0-9]+/part/configure\.log")
            with open(place, encoding="utf-8") as file:
                self.assertIn("/no/such", file.read())
            self.assertEqual(run("build", "--where", "some/part", XDG_CACHE_HOME=folder).stdout,
                             os.path.dirname(place) + "\n")

    def test_packages_have_reasons_and_no_double(self):
        lines = run("install_packages", "test", "--list").stdout.splitlines()
        names = [line.split(":")[0] for line in lines]
        self.assertEqual(len(names), len(set(names)))
        self.assertTrue(all(re.fullmatch(r"[a-z0-9.+-]+: .+", line) for line in lines))
        self.assertTrue(set(run("install_packages", "--list").stdout.splitlines()) < set(lines))


class Build(unittest.TestCase):
    def build(self, ninja):
        """tools/build at a terminal, with a cmake that does nothing and this ninja: code, output, screen."""
        folder = tempfile.TemporaryDirectory(prefix="vergence-build-")
        self.addCleanup(folder.cleanup)
        for name, text in (("cmake", "exit 0"), ("ninja", ninja)):
            path = os.path.join(folder.name, name)
            with open(path, "w", encoding="utf-8") as file:
                file.write(f"#!/bin/sh\n{text}\n")
            os.chmod(path, 0o755)
        master, slave = pty.openpty()
        done = subprocess.run([os.path.join(ROOT, "tools", "build"), "some"], stdout=subprocess.PIPE,
                              stderr=slave, text=True, check=False,
                              env={**os.environ, "XDG_CACHE_HOME": folder.name,
                                   "PATH": f"{folder.name}:{os.environ['PATH']}"})
        os.close(slave)
        screen = b""
        try:
            while data := os.read(master, 1 << 16):
                screen += data
        except OSError:
            pass  # its other end is closed
        os.close(master)
        with open(os.path.join(done.stdout.strip(), "build.log"), encoding="utf-8") as file:
            log = file.read()
        return done.returncode, log, screen.decode()

    def test_progress_is_drawn_in_place_and_erased(self):
        code, log, screen = self.build('for i in 1 2 3; do echo "[$i/3] step $i"; done')
        self.assertEqual((code, log), (0, "[1/3] step 1\n[2/3] step 2\n[3/3] step 3\n"))
        self.assertRegex(screen, r"\[1/3\] step 1\r\x1b\[K\[2/3\] step 2.*\r\x1b\[K$")
        self.assertNotIn("\n", screen)

    def test_nothing_to_do_says_nothing(self):
        self.assertEqual(self.build('echo "ninja: no work to do."')[::2], (0, ""))


if __name__ == "__main__":
    unittest.main()
