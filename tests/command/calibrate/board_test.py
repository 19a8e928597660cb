# SPDX-License-Identifier: Apache-2.0
"""`vergence board`: the print has the right size and is detected by OpenCV and by our detector."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import cv2
import numpy

import boards
from pairs import run

DOTS_A_MM = 10


class Board(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vergence-board-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.page = self.folder / "board.pdf"

    def make(self, *arguments):
        done = run("board", *arguments, "--out", self.page)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return done.stdout

    def printed(self):
        """The page as grey pixels, DOTS_A_MM per millimetre."""
        subprocess.run(["pdftoppm", "-r", str(25.4 * DOTS_A_MM), "-gray", "-singlefile", self.page,
                        self.folder / "page"], check=True, capture_output=True)
        return cv2.imread(str(self.folder / "page.pgm"), cv2.IMREAD_GRAYSCALE)

    def assert_size(self, page, size):
        """Either orientation; the program that renders the page rounds its size up."""
        for got, expected in zip(sorted(page.shape), sorted(size)):
            self.assertAlmostEqual(got, expected, delta=1)

    def test_squares_and_ruler_have_their_size(self):
        output_text = self.make("--board", "9x6", "--square", "24.5")
        self.assertIn("the ruler must be 200 mm long", output_text)
        page = self.printed()
        self.assert_size(page, (2100, 2970))
        found, corners = cv2.findChessboardCorners(page, (9, 6))
        self.assertTrue(found)
        end = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-4)
        corners = cv2.cornerSubPix(page, corners, (20, 20), (-1, -1), end).reshape(6, 9, 2)
        across = numpy.linalg.norm(corners[0, -1] - corners[0, 0]) / 8 / DOTS_A_MM
        down = numpy.linalg.norm(corners[-1, 0] - corners[0, 0]) / 5 / DOTS_A_MM
        self.assertAlmostEqual(across, 24.5, delta=0.01)
        self.assertAlmostEqual(down, 24.5, delta=0.01)
        # The longest dark run of pixels below the board is the ruler's line.
        longest = max(int((row < 100).sum()) for row in page[1850:])
        self.assertAlmostEqual(longest / DOTS_A_MM, 200, delta=0.4)

    def test_papers(self):
        for paper, size in (("A3", (2970, 4200)), ("letter", (2159, 2794)), ("500x300", (3000, 5000))):
            self.make("--board", "9x6", "--square", "20", "--paper", paper)
            self.assert_size(self.printed(), size)

    def test_metres(self):
        self.make("--board", "9x6", "--square", "24.5")
        page = self.page.read_bytes()
        for arguments in (["0.0245", "--unit", "m"], ["2.45", "--unit", "cm"]):
            self.assertIn("squares of 24.5 mm", self.make("--board", "9x6", "--square", *arguments))
            self.assertEqual(self.page.read_bytes(), page)
        self.make("--board", "9x6", "--square", "2.1")  # 21 mm across is above the limit

    def refuse(self, code, *arguments):
        done = run("board", *arguments)
        self.assertEqual((done.returncode, done.stdout), (code, ""))
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        return done.stderr

    def test_rejections(self):
        out = ["--out", self.page]
        line = self.refuse(2, "--board", "9x6", "--square", "30", *out)
        self.assertIn("does not fit on A4", line)
        largest = line.rsplit(" mm)", 1)[0].rsplit(" ", 1)[1]
        self.make("--board", "9x6", "--square", largest)
        self.refuse(2, "--board", "9x6", "--square", str(float(largest) + 0.2), *out)
        for arguments, word in ((["--board", "9x6", "--square", "20"], "--out"),
                                (["--square", "20", *out], "--board"),
                                (["--board", "9x6", *out], "--square"),
                                (["--board", "9x6", "--square", "20", "--paper", "B9", *out], "A4"),
                                (["--board", "13x9", "--square", "15", "--charuco", "5x5_50",
                                  "--marker", "11", *out], "70 markers")):
            self.assertIn(word, self.refuse(2, *arguments))
        line = self.refuse(1, "--board", "9x6", "--square", "20", "--out", self.folder / "no" / "x.pdf")
        self.assertIn("No such file", line)

    def test_circles_are_refused_where_the_board_is_described(self):
        rest = ["--square", "20"]
        for command in (["board", "--out", self.page], ["calibrate", self.folder],
                        ["calibrate", "capture", self.folder / "session"]):
            for pattern in ("circles4x11", "asymmetric_circles 4x11", "Dots9x6", "CIRCLES_GRID",
                            "aprilgrid6x6"):
                done = run(*command, "--board", pattern, *rest)
                self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertIn("only chessboards and ChArUco boards are supported", done.stderr)
                self.assertTrue(done.stderr.startswith("vergence " + command[0]), done.stderr)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_corners_that_are_no_counts_are_refused(self):
        for corners, word in (("9", "9x6"), ("9x", "9x6"), ("x6", "9x6"), ("9x6x4", "9x6"),
                              ("9.5x6", "9x6"), ("1x6", "2 to 255"), ("9x256", "2 to 255"),
                              ("9x99999999999999999999", "2 to 255"), ("-9x6", "2 to 255")):
            line = self.refuse(2, "--board", corners, "--square", "20", "--out", self.page)
            self.assertIn(word, line)

    def test_a_board_that_cannot_be_used_is_refused(self):
        out = ["--out", self.page]
        coded = ["--board", "9x6", "--square", "25", "--charuco", "5x5_50", *out]
        for arguments, word in (([*coded, "--marker", "24.9"], "white"),
                                ([*coded, "--marker", "2"], "too small"),
                                (["--board", "9x6", "--square", "0.025", *out], "--unit"),
                                (["--board", "9x6", "--square", "0.1", "--unit", "mm", *out], "1 mm"),
                                (["--board", "255x255", "--square", "0.001", *out], "--square")):
            self.assertIn(word, self.refuse(2, *arguments))
            self.assertFalse(self.page.exists())
        self.make(*coded[:-2], "--marker", "12.5")
        done = run("board", *coded, "--marker", "21")
        self.assertEqual(done.returncode, 0)
        self.assertIn("note: OpenCV overlooks some markers larger than 19.5 mm", done.stderr)

    def test_what_is_no_file_is_written_to_as_it_stands(self):
        arguments = ["--board", "9X6", "--square", "20"]
        self.make(*arguments)
        expected = self.page.read_bytes()
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        reader = subprocess.Popen(["cat", pipe], stdout=subprocess.PIPE)
        done = run("board", *arguments, "--out", pipe)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(reader.communicate(timeout=10)[0], expected)
        self.assertTrue(pipe.is_fifo())
        # A link to the device, so that an error costs the link and not the machine's device.
        full = self.folder / "full"
        full.symlink_to("/dev/full")
        self.assertIn("No space left",
                      self.refuse(1, *arguments, "--out", full))
        self.assertTrue(full.is_symlink())

    def test_links_stay_and_lead_to_the_new_file(self):
        arguments = ["--board", "9x6", "--square", "20"]
        self.make(*arguments)
        expected = self.page.read_bytes()
        inner = self.folder / "inner"
        inner.mkdir()
        for before in ("old", None):  # an existing file, and a new one
            target, link = inner / "target.pdf", self.folder / "link.pdf"
            link.unlink(missing_ok=True)
            target.unlink(missing_ok=True)
            if before:
                target.write_text(before)
            link.symlink_to("inner/target.pdf")
            done = run("board", *arguments, "--out", link)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertTrue(link.is_symlink())
            self.assertEqual(target.read_bytes(), expected)
        self.assertEqual({p.name for p in inner.iterdir()}, {"target.pdf"})
        circle = self.folder / "circle"
        circle.symlink_to("circle")
        self.assertIn(f"{circle}: ", self.refuse(1, *arguments, "--out", circle))

    def views(self, page):
        """The printed page on a table, seen from six sides; in its own folder."""
        folder = self.folder / "views"
        texture = cv2.resize(page, None, fx=boards.TEXELS_A_MM / DOTS_A_MM,
                             fy=boards.TEXELS_A_MM / DOTS_A_MM, interpolation=cv2.INTER_AREA)
        made = [(boards.picture(texture, boards.pose(*where), scale=2, seed=i), None)
                for i, where in enumerate(boards.POSES[:8])]
        boards.write(folder, made)
        return folder

    def test_coded_boards_are_what_opencv_and_we_detect(self):
        for columns, rows, dictionary, name in ((9, 6, "5x5_50", "DICT_5X5_50"),
                                                (8, 5, "DICT_6X6_250", "DICT_6X6_250"),
                                                (7, 6, "apriltag_36h11", "DICT_APRILTAG_36h11")):
            with self.subTest(dictionary=dictionary):
                self.make("--board", f"{columns}x{rows}", "--square", 24, "--charuco", dictionary,
                          "--marker", 18)
                page = self.printed()
                self.compare_with_opencv(page, columns, rows, name)
                out = self.folder / "out"
                done = run("calibrate", self.views(page), "--single", "--board",
                           f"{columns}x{rows}", "--square", 24, "--charuco", dictionary, "--marker",
                           18, "--out", out)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                corners = (out / "corners.vnl").read_text().splitlines()
                seen = [line for line in corners if not line.startswith("#") and " - " not in line]
                self.assertGreater(len(seen), 0.9 * 8 * columns * rows)

    def compare_with_opencv(self, page, columns, rows, name):
        """Every marker is read at its place on the board, in OpenCV's numbering."""
        aruco = getattr(cv2, "aruco", None)
        if aruco is None or not hasattr(aruco, "CharucoBoard_create"):
            return
        dictionary = aruco.getPredefinedDictionary(getattr(aruco, name))
        theirs = aruco.CharucoBoard_create(columns + 1, rows + 1, 24, 18, dictionary)
        found, numbers, _ = aruco.detectMarkers(page, dictionary)
        self.assertEqual(len(found), (columns + 1) * (rows + 1) // 2)
        _, places, corners = aruco.interpolateCornersCharuco(found, numbers, page, theirs)
        self.assertEqual(len(places), columns * rows)
        there = places[:, 0][numpy.argsort(corners[:, 0])].reshape(rows, columns, 2)
        self.assertTrue((numpy.diff(there[:, :, 0], axis=1) > 0).all())
        self.assertTrue((numpy.diff(there[:, :, 1], axis=0) > 0).all())


if __name__ == "__main__":
    unittest.main()
