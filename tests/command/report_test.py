# SPDX-License-Identifier: Apache-2.0
"""report.html as the user sees it: opened from disk in a headless chromium."""
import io
import json
import os
import re
import subprocess
import tempfile
import unittest

import cv2
import numpy as np
from PIL import Image

from browser import Browser

VERGENCE = os.environ["VERGENCE"]
SAMPLES = os.environ["VERGENCE_OPENCV_SAMPLES"]
READY = "document.documentElement.dataset.ready === 'yes'"
FOCAL_PX, BASELINE_MM = 935.0, 160.0
# File names may contain anything; the page must display and not execute it.
LEFT, RIGHT = 'left <b>&"\'.png', "right <script>alert(1)<.png"


def reconstruct(folder):
    """Aloe at a quarter of its size, for fast software rendering, with ground truth, in folder/out.
    """
    for name, target in (("aloeL.jpg", LEFT), ("aloeR.jpg", RIGHT)):
        image = cv2.imread(os.path.join(SAMPLES, name))
        small = cv2.resize(image, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
        cv2.imwrite(os.path.join(folder, target), small)
    truth = cv2.imread(os.path.join(SAMPLES, "aloeGT.png"), cv2.IMREAD_GRAYSCALE)[::4, ::4]
    truth = truth[:small.shape[0], :small.shape[1]]
    # 256 values per pixel as in KITTI; a quarter of the size has a quarter of the disparities.
    cv2.imwrite(os.path.join(folder, "truth.png"), truth.astype(np.uint16) * 64)
    subprocess.run([VERGENCE, "reconstruct", os.path.join(folder, LEFT),
                    os.path.join(folder, RIGHT), "--rectified", "--focal", str(FOCAL_PX),
                    "--baseline", str(BASELINE_MM), "--disparity", "0:56", "--ground-truth",
                    os.path.join(folder, "truth.png"), "--out", os.path.join(folder, "out"),
                    "--quiet"], check=True, timeout=300)
    return os.path.join(folder, "out")


def picture(png):
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


class Report(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="vergence-report-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.out = reconstruct(cls.folder.name)
        cls.page = os.path.join(cls.out, "report.html")
        cls.disparity = cv2.imread(os.path.join(cls.out, "disparity.pfm"), cv2.IMREAD_UNCHANGED)
        with open(os.path.join(cls.out, "result.json"), encoding="utf-8") as file:
            cls.result = json.load(file)
        cls.browser = Browser(1100, 800)
        cls.addClassCleanup(cls.browser.__exit__)

    def setUp(self):
        self.browser.resize(1100, 800)
        self.browser.open(self.page, READY)
        self.browser.settle()

    def valid_pixel(self, near_x, near_y):
        """A pixel with measured and similar neighbours, so that an aim of half a pixel is harmless.
        """
        near = np.ones((7, 7), np.uint8)
        filled = np.where(np.isfinite(self.disparity), self.disparity, -1000).astype(np.float32)
        minimum, maximum = cv2.erode(filled, near), cv2.dilate(filled, near)
        rows, columns = np.nonzero((minimum > -1000) & (maximum - minimum < 0.4))
        best = np.argmin((rows - near_y) ** 2 + (columns - near_x) ** 2)
        return int(columns[best]), int(rows[best])

    def point_at(self, selector, x, y):
        """Moves the mouse over pixel (x, y) of a picture; returns the readout."""
        left, top, width, height = self.browser.box(selector)
        rows, columns = self.disparity.shape
        self.browser.mouse("mouseMoved", left + (x + 0.5) / columns * width,
                           top + (y + 0.5) / rows * height)
        self.browser.settle()
        return self.browser.evaluate("document.getElementById('readout-text').innerText")

    def view_shot(self):
        self.browser.settle()
        left, top, width, height = self.browser.box("#view")
        # Only what WebGL drew, without the marks and buttons above it.
        self.browser.evaluate("document.querySelectorAll('#view-marks, .viewer-tools, .viewer-scale')"
                              ".forEach(e => { e.style.visibility = 'hidden'; })")
        scroll = self.browser.evaluate("scrollY")
        shot = self.browser.screenshot(clip=(left, top + scroll, width, height))
        self.browser.evaluate("document.querySelectorAll('#view-marks, .viewer-tools, .viewer-scale')"
                              ".forEach(e => { e.style.visibility = ''; })")
        return picture(shot)

    def test_one_file_alone(self):
        """No error, no request but the file itself, and no URL in it that could be requested."""
        self.assertEqual(self.browser.complaints(), [])
        self.assertEqual(len(self.browser.requests()), 1, self.browser.requests())
        self.assertLess(os.path.getsize(self.page), 8e6)
        with open(self.page, encoding="utf-8") as file:
            text = file.read()
        self.assertEqual(re.findall(r"""(?:src|href)=["'](?!data:|#)[^"']*""", text), [])
        self.assertNotRegex(text, r"https?://")

    def test_hostile_names_are_shown_not_obeyed(self):
        title = self.browser.evaluate("document.querySelector('h1').textContent")
        self.assertIn(LEFT, title)
        self.assertIn(RIGHT, title)
        self.assertEqual(self.browser.evaluate("document.querySelectorAll('h1 *').length"), 0)

    def test_surface_is_drawn_and_turns(self):
        first = self.view_shot()
        colours = len(np.unique((first // 16).reshape(-1, 3), axis=0))
        self.assertGreater(colours, 60, "the canvas is blank")
        left, top, width, height = self.browser.box("#view")
        self.browser.drag(left + width * .5, top + height * .5, left + width * .6, top + height * .55)
        turned = self.view_shot()
        self.assertGreater((np.abs(turned - first).max(axis=2) > 30).mean(), 0.05)

    def test_the_first_view_holds_the_surface(self):
        """Only background along the left and the right edge, and something in between."""
        self.browser.open(self.page, READY)
        shot = self.view_shot()
        left, middle, right = (shot[:, x].astype(int) for x in (2, shot.shape[1] // 2, -3))
        self.assertGreater((np.abs(left - right).max(axis=1) < 12).mean(), 0.95)
        self.assertGreater((np.abs(left - middle).max(axis=1) > 24).mean(), 0.3)

    def test_camera_pose_shows_the_photograph(self):
        self.browser.evaluate("document.querySelector('[data-pose=camera]').click()")
        shot = self.view_shot()
        height, width = shot.shape[:2]
        rows, columns = self.disparity.shape
        photo = cv2.imread(os.path.join(self.out, "left_rectified.png"))[:, :, ::-1].astype(int)
        # The picture fills 96 % of the height and is centred.
        scale = height / rows / 1.04
        errors = []
        for x, y in (self.valid_pixel(columns * u, rows * v)
                     for u in (.3, .5, .7, .8) for v in (.2, .5, .8)):
            sx = int(round(width / 2 + (x + .5 - columns / 2) * scale))
            sy = int(round(height / 2 + (y + .5 - rows / 2) * scale))
            errors.append(np.abs(shot[sy - 2:sy + 3, sx - 2:sx + 3].mean(axis=(0, 1)) -
                                 photo[y - 1:y + 2, x - 1:x + 2].mean(axis=(0, 1))).mean())
        self.assertLess(np.median(errors), 12, errors)

    def clip(self, **shares):
        for side, share in shares.items():
            self.browser.evaluate(f"(e => {{ e.value = {1000 * share}; e.dispatchEvent(new Event("
                                  f"'input')); }})(document.getElementById('clip-{side}'))")
        self.browser.settle()

    def reach(self):
        """Shares of the window's width and height that the surface covers."""
        drawn = self.view_shot()
        self.browser.evaluate("document.getElementById('view').style.visibility = 'hidden'")
        mask = np.abs(self.view_shot() - drawn).max(axis=2) > 12
        self.browser.evaluate("document.getElementById('view').style.visibility = ''")
        rows, columns = np.nonzero(mask)
        return [(ends.max() - ends.min() + 1) / size
                for ends, size in zip((columns, rows), mask.shape[::-1])]

    def shown(self):
        return int(self.browser.evaluate("document.getElementById('view').dataset.shown"))

    def test_clipping_leaves_what_is_near_and_frames_it(self):
        whole = self.shown()
        self.assertEqual(self.browser.evaluate("document.getElementById('clip-text').textContent"),
                         "")
        self.clip(far=0.4)
        near = self.shown()
        self.assertTrue(100 < near < 0.9 * whole, near)
        text = self.browser.evaluate("document.getElementById('clip-text').textContent")
        self.assertIn(" to ", text)
        # All of it is in the window, and it fills one of the two directions.
        self.assertTrue(0.8 < max(self.reach()) < 1, self.reach())
        self.browser.evaluate("document.querySelector('[data-pose=top]').click()")
        self.assertTrue(0.8 < max(self.reach()) < 1, self.reach())
        self.clip(left=0.3, right=0.7, top=0.2, bottom=0.8)
        self.assertLess(self.shown(), 0.85 * near)
        self.browser.evaluate("document.getElementById('clip-reset').click()")
        self.assertEqual(self.shown(), whole)
        self.assertEqual(self.browser.complaints(), [])

    def test_the_head_reports_how_bright_the_images_are(self):
        lines = self.browser.evaluate(
            "[...document.querySelectorAll('.camera')].map(e => e.textContent)")
        for line, name in zip(lines, (LEFT, RIGHT), strict=True):
            image = cv2.imread(os.path.join(self.folder.name, name))
            found = float(re.search(r"brightness ([\d.]+) %", line)[1])
            self.assertAlmostEqual(found, image.mean() / 2.55, delta=0.06)

    def test_a_session_is_named_with_its_axes(self):
        session = os.path.join(os.environ["VERGENCE_SESSIONS"], "mug_3x")
        out = os.path.join(self.folder.name, "mug")
        subprocess.run([VERGENCE, "reconstruct", session, "--files", "report.html", "--out", out,
                        "--quiet"], check=True, timeout=300)
        self.browser.open(os.path.join(out, "report.html"), READY)
        head = self.browser.evaluate("document.querySelector('.headline').innerText")
        self.assertIn("mug_3x, pair 1", head)
        self.assertEqual(self.browser.evaluate("document.title"), "mug_3x, pair 1")
        self.assertNotIn("frame-", head)
        for side in ("left", "right"):
            line = next(text for text in head.splitlines() if text.startswith(side))
            for word in ("pan", "zoom", "focus", "iris", "brightness"):
                self.assertIn(word, line)

    def test_every_shading_differs(self):
        shots = [self.view_shot()]
        for shade in (1, 2, 3, 4):
            self.browser.evaluate(f"document.querySelector('[data-shade=\"{shade}\"]').click()")
            shots.append(self.view_shot())
        self.browser.evaluate("document.querySelector('#wire').click()")
        shots.append(self.view_shot())
        for i, a in enumerate(shots):
            for b in shots[i + 1:]:
                self.assertGreater((np.abs(a - b).max(axis=2) > 12).mean(), 0.01)
        self.assertEqual(self.browser.complaints(), [])

    def test_mesh_is_the_result_s_mesh(self):
        """At this size the page thins nothing, so it must join the same triangles."""
        drawn = int(self.browser.evaluate("document.getElementById('view').dataset.triangles"))
        self.assertEqual(drawn, self.result["counts"]["triangles"])

    def test_readout_reports_what_was_measured(self):
        plan = self.result["plan"]
        for near in ((100, 60), (160, 150), (250, 200)):
            x, y = self.valid_pixel(*near)
            text = self.point_at("#pair .frame[data-side=left]", x, y)
            self.assertIn(f"{x}, {y}", text)
            found = float(re.search(r"disparity\s*(-?[\d.]+)", text)[1])
            self.assertAlmostEqual(found, float(self.disparity[y, x]), delta=0.006)
            depth = float(re.search(r"depth\s*([\d.]+)", text)[1])
            wanted = (plan["f_px"] * plan["baseline_mm"] /
                      (float(self.disparity[y, x]) - plan["cx_left_px"] + plan["cx_right_px"]))
            self.assertAlmostEqual(depth / wanted, 1, delta=1e-3)
            places = re.search(r"in the images\s*([-\d.,]+)", text)[1].split(",")
            np.testing.assert_allclose([float(place) for place in places],
                                       [x, y, x - self.disparity[y, x], y], atol=0.11)
            mark = self.browser.evaluate(
                "(() => { const f = document.querySelector('.frame[data-side=right]');"
                " const d = f.querySelector('.dot').getBoundingClientRect(),"
                " b = f.getBoundingClientRect();"
                " return ((d.left + d.right) / 2 - b.left) / b.width; })()")
            columns = self.disparity.shape[1]
            self.assertAlmostEqual(mark * columns - 0.5, x - float(self.disparity[y, x]), delta=1.5)

    def test_readout_names_the_reason(self):
        rows, columns = np.nonzero(~np.isfinite(self.disparity))
        text = self.point_at("#maps .frame", int(columns[len(columns) // 2]),
                             int(rows[len(rows) // 2]))
        self.assertRegex(text, "border|occluded|texture|ambiguous|speckle|range")

    def test_keyboard_steps(self):
        x, y = self.valid_pixel(150, 100)
        self.point_at("#pair .frame[data-side=left]", x, y)
        self.browser.evaluate("document.querySelector('#pair .frame').focus()")
        for key in ("ArrowRight", "ArrowDown", "ArrowDown"):
            self.browser.call("Input.dispatchKeyEvent", type="keyDown", key=key, code=key)
        text = self.browser.evaluate("document.getElementById('readout-text').innerText")
        self.assertIn(f"{x + 1}, {y + 2}", text)
        self.browser.call("Input.dispatchKeyEvent", type="keyDown", key="Escape", code="Escape")
        self.assertTrue(self.browser.evaluate("document.getElementById('readout').hidden"))

    def test_distance_between_two_points(self):
        """Two pixels of the view from the camera: their distance follows from their disparities."""
        self.browser.evaluate("document.querySelector('[data-pose=camera]').click()")
        self.browser.settle()
        left, top, width, height = self.browser.box("#view")
        rows, columns = self.disparity.shape
        plan, points = self.result["plan"], []
        for near in ((75, 75), (225, 60)):
            x, y = self.valid_pixel(*near)
            scale = height / rows / 1.04
            self.browser.click(left + width / 2 + (x + .5 - columns / 2) * scale,
                               top + height / 2 + (y + .5 - rows / 2) * scale)
            z = (plan["f_px"] * plan["baseline_mm"] /
                 (float(self.disparity[y, x]) - plan["cx_left_px"] + plan["cx_right_px"]))
            points.append(np.array([(x - plan["cx_left_px"]) / plan["f_px"] * z,
                                    (y - plan["cy_px"]) / plan["f_px"] * z, z]))
        text = self.browser.evaluate("document.getElementById('measure').textContent")
        found = float(re.search(r"A to B: ([\d.]+)", text)[1])
        wanted = float(np.linalg.norm(points[0] - points[1]))
        self.assertAlmostEqual(found / wanted, 1, delta=0.02)  # the click is accurate to a pixel or two

    def test_errors_are_those_of_evaluate(self):
        run = subprocess.run([VERGENCE, "evaluate", self.out, "--ground-truth",
                              os.path.join(self.folder.name, "truth.png"), "--json"],
                             capture_output=True, text=True, check=True)
        score = json.loads(run.stdout)
        cells = self.browser.evaluate("[...document.querySelectorAll('#accuracy tbody tr')].map("
                                      "r => [...r.cells].map(c => c.textContent))")
        table = {row[0]: row[1:] for row in cells}
        self.assertEqual(table["bad-2"], [f"{score[k]['bad_2_percent']:.2f} %"
                                          for k in ("measured_all", "filled_all")])
        self.assertEqual(table["mean |error|"], [f"{score[k]['average_px']:.3f} px"
                                                 for k in ("measured_all", "filled_all")])

    def test_narrow_and_dark(self):
        self.browser.resize(360, 740, dark=True, touch=True)
        self.browser.open(self.page, READY)
        self.assertLessEqual(self.browser.evaluate("document.documentElement.scrollWidth"), 360)
        shot = picture(self.browser.screenshot())
        self.assertLess(np.median(shot), 60)
        self.assertEqual(self.browser.complaints(), [])

    def test_without_webgl_the_rest_stands(self):
        with Browser(arguments=("--disable-3d-apis",)) as browser:
            browser.open(self.page, READY)
            self.assertIn("WebGL", browser.evaluate("document.getElementById('view-text').innerText"))
            self.assertEqual(browser.complaints(), [])
            self.assertGreater(browser.evaluate("document.querySelectorAll('#maps img').length"), 2)
            # The surface is there as a picture, in more colours than its background has.
            box = browser.evaluate("""(() => {
                const still = document.getElementById('still');
                still.scrollIntoView();
                const box = still.getBoundingClientRect();
                return [box.left, box.top, box.right, box.bottom, still.naturalWidth];
            })()""")
            left, top, right, bottom, natural = (int(value) for value in box)
            self.assertGreater(natural, 500)
            shot = picture(browser.screenshot())[top:bottom, left:right]
            drawn = (np.abs(shot.astype(int) - 0xee).max(axis=2) > 24).mean()
            self.assertGreater(drawn, 0.05)
            self.assertEqual(browser.evaluate(
                "getComputedStyle(document.querySelector('.viewer-tools')).display"), "none")

    def test_no_card_is_clipped(self):
        clipped = """Array.from(document.querySelectorAll('.card')).filter(card => {
            const edge = card.getBoundingClientRect().right - 8;
            return Array.from(card.querySelectorAll('*')).some(part => {
                const range = document.createRange();
                range.selectNodeContents(part);
                return range.getBoundingClientRect().right > edge;
            });
        }).length"""
        for width in (360, 720, 1024, 1300, 1600):
            self.browser.resize(width, 800)
            self.browser.open(self.page, READY)
            self.assertEqual(self.browser.evaluate(clipped), 0, width)

    def test_unusable_truth_is_reported_in_the_page(self):
        small = os.path.join(self.folder.name, "small.png")
        cv2.imwrite(small, np.full((5, 9), 256, np.uint16))
        out = os.path.join(self.folder.name, "small")
        subprocess.run([VERGENCE, "reconstruct", os.path.join(self.folder.name, LEFT),
                        os.path.join(self.folder.name, RIGHT), "--rectified", "--disparity", "0:56",
                        "--ground-truth", small, "--out", out, "--quiet"], check=True, timeout=300)
        self.browser.open(os.path.join(out, "report.html"), READY)
        notes = self.browser.evaluate("document.querySelector('.notes').innerText")
        self.assertIn("9x5", notes)
        self.assertIsNone(self.browser.evaluate("document.querySelector('#accuracy')"))


if __name__ == "__main__":
    unittest.main()
