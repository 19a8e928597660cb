# SPDX-License-Identifier: Apache-2.0
"""`vergence calibrate --touch-up` and `--verify`: pairs of the simulated rig that show the board, whose
corners were found in rendered frames, with a calibration of all zooms that does not know the horns of
the servos."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest
import zlib

import cv2
import numpy as np

VERGENCE = os.environ["VERGENCE"]
CAPTURE = os.path.join(os.environ["VERGENCE_SOURCE"], "tests", "data", "zoom_capture")
TEXT = subprocess.run([os.environ["VERGENCE_ZOOM_RIG"]], capture_output=True, check=True).stdout
BOARD = ["--board", "10x7", "--square", "24", "--charuco", "4x4_50", "--marker", "17"]


def marks_of(session):
    """Two marks of the session's pair in both images, where the true cameras of the session see them: their
    distance, the depth of their middle, and their places as options."""
    words = dict(word.split("=") for line in (session / "session.index").read_text().splitlines()
                 if line.startswith("pair number=1 ") for word in line.split()[1:-1])
    grey = []
    for side in ("left", "right"):
        raw = cv2.imread(str(session / f"frame-{words[side + '_frame']}.pnm"), cv2.IMREAD_UNCHANGED)
        grey.append((cv2.cvtColor(raw, cv2.COLOR_BayerGB2GRAY) / 4).clip(0, 255).astype(np.uint8))
    search = {"winSize": (31, 31), "maxLevel": 4}
    left = cv2.goodFeaturesToTrack(grey[0], 200, 0.05, 25)
    right, found, _ = cv2.calcOpticalFlowPyrLK(grey[0], grey[1], left, None, **search)
    again, _, _ = cv2.calcOpticalFlowPyrLK(grey[1], grey[0], right, None, **search)
    keep = (found[:, 0] == 1) & (np.linalg.norm(again - left, axis=2)[:, 0] < 0.05)
    left, right = left[keep].astype(np.float64), right[keep].astype(np.float64)
    lines = next(session.glob("calibration-*.txt")).read_text(encoding="ascii").splitlines()
    rig = dict(line.split(" ", 1) for line in lines if " " in line)

    def numbers(name):
        return [float(word) for word in rig.get(name, "0").split()]

    rays = []
    for side, pixels in (("left", left), ("right", right)):
        (fx, fy), (cx, cy) = numbers(side + "_focal_px"), numbers(side + "_centre_px")
        bend = [numbers(f"{side}_k{i}")[0] for i in (1, 2, 3)]
        lens = np.array([*bend[:2], *numbers(side + "_tangential"), bend[2]])
        rays.append(cv2.undistortPoints(pixels, np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), lens)[:, 0].T)
    turn = cv2.Rodrigues(np.array(numbers("rotation_right_left_rad")))[0]
    pose = np.hstack([turn, np.array(numbers("translation_right_left_mm"))[:, None]])
    points = cv2.triangulatePoints(np.eye(3, 4), pose, *rays)
    points /= points[3]
    seen = pose @ points
    fits = np.linalg.norm(seen[:2] / seen[2] - rays[1], axis=0) * numbers("right_focal_px")[0] < 0.3
    left, right, points = left[fits, 0], right[fits, 0], points[:3, fits]
    ends = [np.argmin(left[:, 0]), np.argmax(left[:, 0])]
    places = [",".join(f"{value:.3f}" for value in (*left[end], *right[end])) for end in ends]
    first, last = points[:, ends[0]], points[:, ends[1]]
    return np.linalg.norm(first - last), 0.5 * (first + last)[2], places


class TouchUp(unittest.TestCase):
    def setUp(self):
        self.here = tempfile.mkdtemp(prefix="vergence-touch-up-")
        self.addCleanup(shutil.rmtree, self.here)
        self.zoom = os.path.join(self.here, "instrument.zoom")
        with open(self.zoom, "wb") as file:
            file.write(TEXT)

    def look(self, zoom, *options, session=CAPTURE, board=None):
        return subprocess.run(
            [VERGENCE, "calibrate", session, "--corners", os.path.join(CAPTURE, "corners.vnl"),
             *(board or BOARD), *options[:1], zoom, *options[1:]],
            capture_output=True, text=True, timeout=300)

    def touch_up(self, zoom):
        self.out = os.path.join(self.here, "out")
        return self.look(zoom, "--touch-up", "--out", self.out)

    def changed(self, field, change):
        """The calibration with the values of a field changed, and the right checksum."""
        lines = TEXT.decode("ascii").splitlines()
        for i, line in enumerate(lines):
            name, *values = line.split(" ")
            if name == field:
                lines[i] = " ".join((name, *change(values)))
        body = "\n".join(lines[:-1]) + "\n"
        path = os.path.join(self.here, "changed.zoom")
        with open(path, "w", encoding="ascii") as file:
            file.write(body + f"crc32 {zlib.crc32(body.encode('ascii')):08x}\n")
        return path

    def test_the_size_of_the_board_corrects_each_pair(self):
        done = self.touch_up(self.zoom)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(os.path.join(self.out, "calibration.json"), encoding="ascii") as file:
            looks = json.load(file)["touch_up"]
        self.assertGreater(len(looks), 5)
        numbers = [int(look["pair"].removeprefix("zoom_capture:")) for look in looks]
        self.assertEqual(numbers, sorted(numbers))
        for look in looks:
            # The servos' horns, which this calibration does not know, are off by 1.1 degrees
            # together, 2.6 of its standard deviations; the servos rest somewhere beside that.
            read, refined, corrected = look["read"], look["refined"], look["corrected"]
            sigmas = abs(read["square_mm"] - 24) / read["square_sigma_mm"]
            self.assertAlmostEqual(read["square_z"], sigmas, delta=1e-6)
            self.assertLess(sigmas, 8)
            self.assertEqual(look["holds"], max(sigmas, read["rows_z"], refined["square_z"]) < 4)
            # It does not know the ripple of the lenses' cams either: 0.1 % of f at the wide end.
            self.assertAlmostEqual(corrected["square_mm"], 24, delta=0.05)
            self.assertLess(corrected["rows_px"], 0.15)
            self.assertLess(corrected["depth_sigma_mm"], 0.2 * read["depth_sigma_mm"])

    def test_a_look_at_the_board_verifies_the_calibration(self):
        one = f"{CAPTURE}:8"
        done = self.look(self.zoom, "--verify", session=one)
        # One look at 1x would not show an error of a few percent, and says so.
        self.assertEqual(done.returncode, 5, done.stderr)
        self.assertIn("zoom_capture:8 ", done.stdout)
        self.assertRegex(done.stderr, r"Undecided: .* errors above \d\.\d % are excluded")
        self.assertEqual(os.listdir(self.here), ["instrument.zoom"])
        self.assertFalse(os.path.exists("calibration"))
        # With the servos' horns, by which the cameras stand 1.1 degrees closer.
        horns = self.changed("right_rotation_rad", lambda turn: (
            turn[0], f"{float(turn[1]) - np.radians(1.1):.12f}", turn[2]))
        done = self.look(horns, "--verify", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        page = json.loads(done.stdout)
        self.assertTrue(page["verdict"]["good"])
        self.assertRegex(page["verdict"]["sentence"],
                         r"^Good: the squares agree within \d\.\d %: errors above \d\.\d % are excluded")
        best = min((look[fit]["square_sigma_mm"] for look in page["verify"] for fit in ("read", "refined")))
        self.assertAlmostEqual(page["excluded_above"] - page["off"], 3 * best / 24, delta=1e-9)
        self.assertLess(page["excluded_above"], 0.05)
        look = next(look for look in page["verify"] if look["pair"] == "zoom_capture:8")
        self.assertNotIn("corrected", look)
        # Rows do not show the size: the deviation of depth, and so of the squares, remains.
        self.assertLess(look["refined"]["rows_px"], 0.1)
        self.assertLess(look["refined"]["square_z"], 4)
        self.assertGreater(look["refined"]["depth_sigma_mm"], 1)

    def assert_not_good(self, done, *words):
        self.assertEqual(done.returncode, 5, done.stdout)
        line, = done.stderr.splitlines()
        self.assertTrue(line.startswith("vergence calibrate: Not good: zoom_capture:"), line)
        for word in words:
            self.assertIn(word, line)

    def test_a_bumped_camera_and_a_wrong_side_are_not_as_predicted(self):
        bumped = self.changed("right_rotation_rad", lambda turn: (f"{float(turn[0]) + 0.01:.12f}",
                                                                   *turn[1:]))
        one = f"{CAPTURE}:8"
        self.assert_not_good(self.look(bumped, "--verify", session=one), ":8", "calibrate")
        larger = [*BOARD[:3], "30", *BOARD[4:]]
        self.assert_not_good(self.look(self.zoom, "--verify", session=one, board=larger), "squares")

    def test_what_cannot_be_verified_is_refused_in_one_line(self):
        def refused(code, done, *words):
            self.assertEqual(done.returncode, code, done.stdout)
            line, = done.stderr.splitlines()
            for word in words:
                self.assertIn(word, line)

        other = self.changed("instrument", lambda name: ("other",))
        refused(3, self.look(other, "--verify"), "other", "rig")
        refused(3, self.look(self.changed("left_zoom_counts", lambda range: ("900.000", "950.000")),
                             "--verify"), "left zoom", "outside")
        refused(3, self.look(self.zoom, "--verify", session=f"{CAPTURE}:900"), "no pair 900")
        refused(2, self.look(self.zoom, "--verify", "--touch-up", self.zoom), "combined")
        # Of another board the kept corners are not; a smaller one has no such corners.
        smaller = ["--board", "7x5", *BOARD[2:]]
        refused(3, self.look(self.zoom, "--verify", board=smaller), "board")

    def marked(self, *options, session=f"{CAPTURE}:1"):
        """The outcome of marks in the first pair."""
        self.out = os.path.join(self.here, "out")
        return subprocess.run([VERGENCE, "calibrate", session, "--touch-up", self.zoom, "--out", self.out,
                               *options], capture_output=True, text=True, timeout=300)

    def outcome(self, done):
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(os.path.join(self.out, "calibration.json"), encoding="ascii") as file:
            look, = json.load(file)["touch_up"]
        with open(os.path.join(self.out, "rig.calibration"), encoding="ascii") as file:
            rig = dict(line.split(" ", 1) for line in file.read().splitlines() if " " in line)
        return look, {name: [float(word) for word in rig[name].split()]
                      for name in ("left_centre_px", "right_centre_px", "right_focal_px", "right_k1",
                                   "right_k2", "rotation_right_left_rad")}

    def corner(self, index):
        """Column and row in both pictures of the first pair."""
        with open(os.path.join(CAPTURE, "session.index"), encoding="ascii") as file:
            pair = next(line for line in file if line.startswith("pair number=1 "))
        words = dict(word.split("=") for word in pair.split()[1:-1])
        places = []
        for side in ("left", "right"):
            with open(os.path.join(CAPTURE, "corners.vnl"), encoding="ascii") as file:
                lines = [line.split() for line in file
                         if line.startswith(f"frame-{words[f'{side}_frame']}.pnm ")]
            places += lines[index][1:3]
        return ",".join(places)

    def test_two_marks_and_their_distance_correct_a_pair(self):
        # Corners of the board that are 9 and 6 squares apart.
        marks = ("--length", f"{24 * 117 ** 0.5:.4f}", "--from", self.corner(0), "--to",
                 self.corner(69))
        look, found = self.outcome(self.marked(*marks))
        self.assertEqual(look["corners"], 2)
        self.assertAlmostEqual(look["corrected"]["square_mm"], 24 * 117 ** 0.5, delta=0.3)
        self.assertLess(look["corrected"]["depth_sigma_mm"], 0.3 * look["read"]["depth_sigma_mm"])
        # By the whole board.
        done = self.look(self.zoom, "--touch-up", "--out", self.out, session=f"{CAPTURE}:1")
        board, true = self.outcome(done)
        self.assertAlmostEqual(look["depth_mm"], board["depth_mm"],
                               delta=4 * look["corrected"]["depth_sigma_mm"] + 60)
        # A thing at infinity, straight ahead of the left camera, as the board shows it.
        turn = true["rotation_right_left_rad"]
        x, y = turn[1], -turn[0]  # small angles; the length of the vector is below 2 degrees
        grow = 1 + true["right_k1"][0] * (x * x + y * y) + true["right_k2"][0] * (x * x + y * y) ** 2
        right = [centre + focal * slope * grow for centre, focal, slope in
                 zip(true["right_centre_px"], true["right_focal_px"], (x, y))]
        far = ",".join(f"{value:.3f}" for value in (*true["left_centre_px"], *right))
        look, found = self.outcome(self.marked("--infinity", far))
        self.assertEqual(look["corners"], 0)
        self.assertLess(look["corrected"]["depth_sigma_mm"], 0.3 * look["read"]["depth_sigma_mm"])
        self.assertAlmostEqual(found["rotation_right_left_rad"][1], turn[1], delta=0.0015)
        both, _ = self.outcome(self.marked("--infinity", far, *marks))
        self.assertLess(both["corrected"]["depth_sigma_mm"], look["corrected"]["depth_sigma_mm"])

    def test_marks_are_solved_together_with_the_pairs_own_matches(self):
        session = pathlib.Path(os.environ["VERGENCE_SESSIONS"]) / "cylinder_1x"
        length_mm, depth_mm, ends = marks_of(session)
        marks = ("--from", ends[0], "--to", ends[1])
        done = self.marked("--length", f"{length_mm:.4f}", *marks, session=f"{session}:1")
        look, _ = self.outcome(done)
        for word in ("length", "2 marks", "own matches"):
            self.assertIn(word, done.stdout)
        self.assertNotIn("squares", done.stdout)
        self.assertGreater(look["matches"], 100)
        self.assertLess(look["own_rows_corrected_px"], 0.1)
        self.assertLess(look["refined"]["depth_sigma_mm"], 0.4 * look["read"]["depth_sigma_mm"])
        self.assertLess(look["corrected"]["depth_sigma_mm"], 0.5 * look["refined"]["depth_sigma_mm"])
        self.assertAlmostEqual(look["depth_mm"], depth_mm, delta=4 * look["corrected"]["depth_sigma_mm"])
        # Another length than the matches allow: written, with what is wrong.
        done = self.marked("--length", f"{0.95 * length_mm:.4f}", *marks, session=f"{session}:1")
        self.assertEqual(done.returncode, 5, done.stdout)
        self.assertRegex(done.stderr, "Not good: cylinder_1x:1: the length is off by .* check the marks")
        with open(os.path.join(self.out, "rig.calibration"), encoding="ascii") as file:
            self.assertIn("\nnote NOT GOOD: cylinder_1x:1: the length is off by", file.read())
        # A near thing is not at infinity.
        done = self.marked("--infinity", ends[0], session=f"{session}:1")
        self.assertEqual(done.returncode, 3, done.stdout)
        self.assertIn("do not fit", done.stderr)

    def test_marks_that_do_not_fit_together_are_refused(self):
        for code, words, options in (
                (2, "--from and --to", ("--length", "100")),
                (2, "one pair", ("--length", "100", "--from", "1,1,1,1", "--to", "9,9,9,9")),
                (2, "combined", ("--length", "100", "--from", "1,1,1,1", "--to", "9,9,9,9", *BOARD)),
                (3, "do not fit", ("--infinity", "100,100,100,1400")),
                (3, "do not fit", ("--length", "100", "--from", "1000,700,1000,900", "--to",
                                   "1300,700,1300,500"))):
            session = CAPTURE if words == "one pair" else f"{CAPTURE}:1"
            done = self.marked(*options, session=session)
            self.assertEqual(done.returncode, code, done.stdout + done.stderr)
            line, = done.stderr.splitlines()
            self.assertIn(words, line)

    def test_the_corrected_calibration_is_one_of_its_state(self):
        self.assertEqual(self.touch_up(self.zoom).returncode, 0)
        rig = os.path.join(self.out, "rig.calibration")
        page = subprocess.run([VERGENCE, "info", rig, "--json"], capture_output=True, text=True,
                              check=True, timeout=60)
        self.assertAlmostEqual(json.loads(page.stdout)[0]["baseline_mm"], 245, delta=8)
        with open(rig, encoding="ascii") as file:
            self.assertIn("axes_in_sigma yes\n", file.read())

    def test_a_calibration_of_one_state_is_refused(self):
        self.assertEqual(self.touch_up(self.zoom).returncode, 0)
        rig = os.path.join(self.here, "one.calibration")
        shutil.copy(os.path.join(self.out, "rig.calibration"), rig)
        done = self.touch_up(rig)
        self.assertEqual(done.returncode, 3)
        self.assertIn("not a calibration of all zooms", done.stderr)


if __name__ == "__main__":
    unittest.main()
