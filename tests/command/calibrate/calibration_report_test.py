# SPDX-License-Identifier: Apache-2.0
"""calibration.html as the user sees it: opened from disk in a headless chromium."""
import base64
import io
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import cv2
import numpy as np
from PIL import Image

from browser import Browser

VERGENCE = os.environ["VERGENCE"]
SAMPLES = pathlib.Path(os.environ["VERGENCE_OPENCV_SAMPLES"])
READY = "document.documentElement.dataset.ready === 'yes'"
NUMBERS = [f"{i:02d}" for i in range(1, 15) if i != 10]
HOSTILE = "<b>&\"'"  # in a file name: displayed, not executed


def calibrate(pictures, out, *more):
    done = subprocess.run([VERGENCE, "calibrate", str(pictures), "--board", "9x6", "--square", "30",
                           "--out", str(out), "--quiet", *more], capture_output=True, text=True,
                          timeout=600)
    return done


class CalibrationReport(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.here = pathlib.Path(tempfile.mkdtemp(prefix="vergence-calibration-report-"))
        cls.addClassCleanup(shutil.rmtree, cls.here)
        pictures = cls.here / "pictures"
        pictures.mkdir()
        for number in NUMBERS:
            for side in ("left", "right"):
                shutil.copy(SAMPLES / f"{side}{number}.jpg", pictures)
        # One pair without a board, with a malicious name.
        for side in ("left", "right"):
            grey = np.full((480, 640), 90, np.uint8)
            cv2.imwrite(str(pictures / f"{side}99{HOSTILE}.png"), grey)
        cls.out = cls.here / "out"
        done = calibrate(pictures, cls.out)
        assert done.returncode == 0, done.stderr
        cls.pictures = pictures
        cls.page = cls.out / "calibration.html"
        cls.json = json.loads((cls.out / "calibration.json").read_text())
        cls.browser = Browser(1280, 900)
        cls.addClassCleanup(cls.browser.__exit__)

    def setUp(self):
        self.browser.resize(1280, 900)
        self.browser.open(self.page, READY)
        self.browser.settle()

    def text(self, selector):
        return self.browser.evaluate(
            f"document.querySelector({json.dumps(selector)}).innerText")

    def card(self, name):
        """Value of the card with this name."""
        return self.browser.evaluate(
            "[...document.querySelectorAll('.card')].find(c => c.querySelector('.name')"
            f".textContent === {json.dumps(name)}).querySelector('.value').innerText")

    def test_one_file_alone(self):
        self.assertEqual(self.browser.complaints(), [])
        self.assertEqual(len(self.browser.requests()), 1, self.browser.requests())
        self.assertLess(self.page.stat().st_size, 8e6)
        text = self.page.read_text(encoding="utf-8")
        self.assertEqual(re.findall(r"""(?:src|href)=["'](?!data:|#)[^"']*""", text), [])
        self.assertNotRegex(text, r"https?://")
        self.assertNotRegex(text, r"\b(nan|inf)\b")

    def test_same_input_same_bytes(self):
        again = self.here / "again"
        self.assertEqual(calibrate(self.pictures, again, "--threads", "1").returncode, 0)
        self.assertEqual((again / "calibration.html").read_bytes(), self.page.read_bytes())

    def test_verdict_comes_first_and_figures_are_those_of_the_json(self):
        verdict = self.text("#verdict")
        self.assertTrue(verdict.startswith("Good:"), verdict)
        first = self.browser.evaluate("document.querySelector('main').innerText.slice(0, 300)")
        self.assertIn(verdict[:40], first)
        focal_px = float(self.card("Focal length, left").split()[0])
        self.assertLess(abs(focal_px - 533.5), 3)
        baseline_mm = float(self.card("Baseline").split()[0])
        self.assertLess(abs(baseline_mm - 99.8), 0.3)
        self.assertLess(float(self.card("Rows agree within").split()[0]), 0.2)
        rig = (self.out / "rig.calibration").read_text()
        reported_px = float(re.search(r"^left_focal_px ([\d.]+)", rig, re.M)[1])
        self.assertAlmostEqual(focal_px, reported_px, delta=0.006)

    def test_rejected_pictures_are_shown_with_their_reason(self):
        figures = self.browser.evaluate(
            "[...document.querySelectorAll('#rejected figure')].map(f => [f.innerText, "
            "f.querySelector('img') ? f.querySelector('img').naturalWidth : 0])")
        named = [figure for figure in figures if HOSTILE in figure[0]]
        self.assertEqual(len(named), 2, figures)
        for words, width in named:
            self.assertGreater(len(words.splitlines()[-1]), 10, words)
            self.assertGreater(width, 100)
        self.assertEqual(self.browser.evaluate("document.querySelectorAll('figcaption b b').length"),
                         0)

    def test_what_to_photograph_next_is_concrete(self):
        hint = self.text("#next .panel")
        self.assertRegex(hint, r"the (top|bottom|left side|right side|middle)[a-z ]* of the "
                               r"(left|right) image")
        self.assertRegex(hint, r"(left|right|top|bottom) edge tilted away by 30 to 40 degrees")
        self.assertRegex(hint, r"at about [\d.]+ m?m")

    def test_rows_of_the_rectified_pair_agree(self):
        """The board's corners, found by OpenCV in the page's own pictures, are on equal rows."""
        rows = []
        for i in range(2):
            uri = self.browser.evaluate(f"document.querySelectorAll('.pair img')[{i}].src")
            data = cv2.imdecode(np.frombuffer(base64.b64decode(uri.split(",")[1]),
                                              np.uint8), cv2.IMREAD_GRAYSCALE)
            found, corners = cv2.findChessboardCornersSB(data, (9, 6))
            self.assertTrue(found)
            rows.append(corners[:, 0, 1])
        self.assertLess(np.sqrt(np.mean((rows[0] - rows[1]) ** 2)), 0.3)

    def test_pointing_at_one_picture_marks_the_row_in_both(self):
        left, top, width, height = self.browser.box(".pair .frame")
        self.browser.mouse("mouseMoved", left + width / 3, top + height / 4)
        self.browser.settle()
        tops = self.browser.evaluate(
            "[...document.querySelectorAll('.row-hair')].map(h => getComputedStyle(h).display + "
            "Math.round(h.getBoundingClientRect().top))")
        self.assertEqual(len(set(tops)), 1, tops)
        self.assertTrue(tops[0].startswith("block"))

    def test_every_drawing_has_marks(self):
        empty = self.browser.evaluate(
            "[...document.querySelectorAll('svg.plot, svg.field')].filter(s => "
            "[...s.querySelectorAll('.dots, .line, .stroke, .bar-fill')]"
            ".every(m => m.tagName === 'path' && !m.getAttribute('d'))).length")
        self.assertEqual(empty, 0)
        self.assertGreaterEqual(
            self.browser.evaluate("document.querySelectorAll('svg.plot, svg.field').length"), 10)

    def test_narrow_and_dark(self):
        for width in (1280, 390):
            for dark in (False, True):
                self.browser.resize(width, 900, dark=dark)
                self.browser.open(self.page, READY)
                self.browser.settle()
                self.assertLessEqual(self.browser.evaluate("document.documentElement.scrollWidth"),
                                     width)
                shot = np.asarray(Image.open(io.BytesIO(self.browser.screenshot())).convert("L"))
                self.assertEqual(np.median(shot) < 100, dark)
        self.browser.evaluate("document.getElementById('theme').click()")
        self.assertEqual(self.browser.evaluate("document.documentElement.dataset.theme"), "light")

    def test_it_prints_on_a_few_pages(self):
        printed = self.here / "printed.pdf"
        printed.write_bytes(base64.b64decode(self.browser.call("Page.printToPDF")["data"]))
        reported = subprocess.run(["pdfinfo", str(printed)], capture_output=True, text=True).stdout
        self.assertLessEqual(int(re.search(r"Pages: +(\d+)", reported)[1]), 8)

    def test_one_camera(self):
        left = self.here / "left"
        left.mkdir()
        for number in NUMBERS:
            shutil.copy(SAMPLES / f"left{number}.jpg", left)
        done = calibrate(left, self.here / "one", "--single")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.browser.open(self.here / "one" / "calibration.html", READY)
        self.assertEqual(self.browser.complaints(), [])
        self.assertEqual(self.browser.evaluate("document.querySelectorAll('#pair').length"), 0)
        self.assertTrue(self.text("#verdict").startswith("Good:"))


if __name__ == "__main__":
    unittest.main()
