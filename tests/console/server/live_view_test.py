# SPDX-License-Identifier: Apache-2.0
"""`vergence view` in a headless chromium: on the simulated rig, on webcams of a fake kernel that it
starts vergenced for, and on a recorded session."""
import http.client
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import unittest

import cv2
import numpy

from daemon_process import TIMEOUT_S, VERGENCED, DaemonTest
from fake_devices import DeviceTest, preloaded, show
from waiting import wait_until

sys.path.insert(0, os.path.join(os.environ["VERGENCE_SOURCE"], "tests", "command"))

import boards  # noqa: E402
from browser import Browser  # noqa: E402

VERGENCE = os.environ["VERGENCE"]
NUMBER = "Number(document.getElementById('stage')?.dataset.number || 0)"


class View:
    """The program that serves the page; `url` is its address."""

    def __init__(self, folder, *words, environment=None, browser=("--no-browser",)):
        self.folder, self.out = folder, os.path.join(folder, "out")
        self.errors = open(os.path.join(folder, "view.err"), "w+", encoding="utf-8")
        self.process = subprocess.Popen(
            [VERGENCE, "view", *words, *browser, "--out", self.out], stdout=subprocess.PIPE,
            stderr=self.errors, text=True, env=environment, cwd=folder)
        self.url = self.process.stdout.readline().strip()
        self.errors.seek(0)
        assert self.url, self.errors.read()
        _, self.host, self.path = re.fullmatch(r"(http)://([\d.:]+)(/.*)", self.url).groups()

    def end(self):
        self.process.send_signal(signal.SIGINT)
        code = self.process.wait(TIMEOUT_S)
        self.process.stdout.close()
        self.errors.close()
        assert code == 0, code

    def request(self, method, path, body=None, **headers):
        """Status, what is known of the content, and the content."""
        line = http.client.HTTPConnection(self.host, timeout=TIMEOUT_S)
        line.request(method, path, body, headers)
        answer = line.getresponse()
        data = answer.read()
        line.close()
        return answer.status, json.loads(answer.headers.get("X-Vergence") or "{}"), data

    def picture(self, after=0):
        """Number, left and right half of the first picture after this one."""
        status, about, data = self.request("GET", f"{self.path}picture?after={after}")
        assert status == 200, (status, data)
        both = cv2.imdecode(numpy.frombuffer(data, numpy.uint8), cv2.IMREAD_GRAYSCALE)
        middle = both.shape[1] // 2
        return about["number"], both[:, :middle], both[:, middle:]


class Page:
    """For tests with a page in `browser`."""

    def until(self, expression):
        wait_until(lambda: self.browser.evaluate(expression),
                   lambda: f"{expression}: {self.browser.complaints()} "
                           f"{self.browser.evaluate('document.body.innerText')}")

    def text(self, name):
        return self.browser.evaluate(f"document.getElementById('{name}').textContent")

    def click(self, selector):
        self.browser.evaluate(f"document.querySelector({json.dumps(selector)}).click()")

    def opened(self, view, width=1100):
        self.browser = Browser(width, 900)
        self.addCleanup(self.browser.__exit__)
        self.browser.open(view.url, f"{NUMBER} > 0")

    def newer(self):
        number = self.browser.evaluate(NUMBER)
        self.until(f"{NUMBER} > {number}")

    def typed(self, line):
        """Sends a line of the console by the page; returns its answer as shown in the log."""
        count = self.browser.evaluate("document.querySelectorAll('#log li').length")
        self.browser.evaluate(f"document.querySelector('#line input').value = {json.dumps(line)};"
                              "document.querySelector('#line').requestSubmit()")
        last = "document.querySelector('#log li:last-child .answer')"
        self.until(f"document.querySelectorAll('#log li').length > {count} && "
                   f"!{last}.textContent.startsWith('…')")
        return self.browser.evaluate(f"{last}.textContent")

    def depth_at(self, x, y):
        """What the page says of the depth at this share of the map."""
        panes = self.browser.box("#stage")
        half = panes[2] / 2
        self.browser.mouse("mouseMoved", panes[0] + half + x * half, panes[1] + y * panes[3])
        found = re.match(r"Here: ([\d.]+) (mm|m)", self.text("depth-here"))
        if not found:
            return None
        return float(found[1]) * (1000 if found[2] == "m" else 1)

    def middle_depth(self, y, *columns):
        """The median of the depths at these places of a row; NaN: none was measured."""
        found = [depth for depth in (self.depth_at(x, y) for x in columns) if depth is not None]
        return numpy.median(found) if found else numpy.nan


class OnTheRig(Page, DaemonTest):
    scene = "cylinder"

    @classmethod
    def begin_rig(cls, *words):
        super().begin_rig("--wall", *words)

    def setUp(self):
        client = self.client()
        with open(os.path.join(self.files, "instrument.zoom"), "wb") as file:
            file.write(subprocess.run([os.environ["VERGENCE_ZOOM_RIG"]], capture_output=True,
                                      check=True).stdout)
        for command in ("bringup", "calibration set instrument.zoom", "window 2048 1536 skip=8",
                        "zoom 1x", "focus 1800 mm", "aim distance=1800", "exposure 8 ms"):
            answer = client.ask_json(command)
            self.assertTrue(answer["ok"], answer)
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.view = View(scratch.name, f"unix:{self.path}")
        self.addCleanup(self.view.end)

    def moved(self, before):
        """By how many pixels the left half has moved to the left since `before`."""
        after = self.view.picture(self.view.picture()[0])[1]
        apart, _ = cv2.phaseCorrelate(before.astype(float), after.astype(float))
        return -apart[0]

    def test_what_the_page_shows_and_does(self):
        self.opened(self.view)
        self.assertEqual(self.browser.complaints(), [])
        _, before, _ = self.view.picture()
        self.assertIn("left 5", self.typed("pan 5"))
        self.newer()
        self.assertGreater(abs(self.moved(before)), 5)
        self.assertIn("ARGUMENT", self.typed("turn 3"))
        self.typed("aim distance=1800")
        # The click at three quarters of the left picture brings that place to the middle.
        _, before, _ = self.view.picture(self.view.picture()[0])
        self.click("#aim")
        left, top, width, height = self.browser.box("#stage")
        self.browser.click(left + 0.3 * width, top + 0.5 * height)
        self.until("[...document.querySelectorAll('#log li')].some((l) => /^pan \\S+ right=/.test(l.innerText))")
        self.until("!document.querySelector('#log li:last-child .answer').textContent.startsWith('…')")
        shift = self.moved(before)
        self.assertAlmostEqual(shift, (0.6 - 0.5) * before.shape[1], delta=0.02 * before.shape[1])
        self.typed("aim distance=1800")

        self.click("[data-mode=depth]")
        self.until("Number(document.getElementById('stage').dataset.depths || 0) > 1")
        # The wall is 1.2 m behind the cylinder.
        wait_until(lambda: self.middle_depth(0.5, 0.48, 0.5, 0.52) + 300 <
                   self.middle_depth(0.2, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7), lambda: self.text("depth-state"))
        self.until("/^Here: .* ± /.test(document.getElementById('depth-here').textContent)")
        self.assertRegex(self.text("depth-state"), r"\d+ % measured; rows ")
        for name in ("rows", "peaking", "zebra"):
            self.click(f"[data-mark={name}]")
        for mode in ("rectified", "anaglyph", "blink", "side"):
            self.click(f"[data-mode={mode}]")
            self.newer()
        self.browser.drag(left + 0.1 * width, top + 0.3 * height, left + 0.3 * width, top + 0.6 * height)
        self.until("/^Focus of /.test(document.getElementById('sharp').textContent)")
        for width in (1100, 420):
            self.browser.resize(width, 900, dark=True)
            self.browser.settle()
            self.assertLessEqual(*self.browser.evaluate(
                "[document.documentElement.scrollWidth, innerWidth]"))
        self.assertEqual(self.browser.complaints(), [])
        requests = {url[:len(self.view.url)] for url in self.browser.requests()
                    if not url.startswith("blob:")}
        self.assertEqual(requests, {self.view.url})

    def test_only_this_page_is_served(self):
        path, host = self.view.path, self.view.host
        for wrong, headers in ((path[:-2] + "x/", {}), ("/", {}), ("/../etc/passwd", {}),
                               (path, {"Host": "example.com"}),
                               (path, {"Origin": "http://example.com"}), (path, {"Origin": "null"})):
            for method, body in (("GET", None), ("POST", "pan 9")):
                place = wrong + ("command" if method == "POST" and wrong == path else "")
                status, _, data = self.view.request(method, place, body, **headers)
                self.assertIn(status, (400, 403, 404), (method, wrong, headers, data))
        for name in ("out/../../etc", "file/absent", "out/absent"):
            self.assertIn(self.view.request("GET", path + name)[0], (403, 404), name)
        status, _, data = self.view.request("POST", path + "command", "pan", Origin=f"http://{host}")
        self.assertEqual((status, json.loads(data)["ok"]), (200, True))
        busy = subprocess.run([VERGENCE, "view", f"unix:{self.path}", "--no-browser", "--port",
                               host.split(":")[1]], capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual((busy.returncode, busy.stderr.count("\n"), "is in use" in busy.stderr),
                         (1, 1, True), busy.stderr)


class OnWebcams(Page, DeviceTest):
    def setUp(self):
        super().setUp()
        with open(self.place("script"), "w", encoding="ascii") as file:
            file.write(self.cameras())

    def started(self, *words):
        view = View(self.folder, *words, environment=preloaded(self.place("script")))
        self.addCleanup(view.end)
        return view

    def tearDown(self):
        """Here vergenced is the program's own."""

    def test_two_webcams_need_no_daemon_and_two_viewers_see_them(self):
        view = self.started("--cameras", "/dev/video0,/dev/video1")
        self.opened(view)
        self.until(f"{NUMBER} > 5")
        number = view.picture()[0]
        self.assertGreater(view.picture(number)[0], number)
        self.click("[data-mode=depth]")
        self.until("/no calibration is saved/.test(document.getElementById('alert').textContent)")
        self.click("[data-run='Capture']")
        self.until("/^capture view-/.test(document.querySelector('#log li:last-child code').textContent)"
                   " && !document.querySelector('#log li:last-child .answer').textContent.startsWith('…')")
        session = self.browser.evaluate(
            "document.querySelector('#log li:last-child code').textContent").split()[1]
        self.assertTrue(pathlib.Path(view.out, "files", session, "session.index").exists())
        daemons = subprocess.run(["pgrep", "-f", f"files={view.out}/files"], text=True,
                                 capture_output=True, check=True).stdout.split()
        self.assertEqual(len(daemons), 1)
        recorded = View(tempfile.mkdtemp(dir=self.folder), os.path.join(view.out, "files", session),
                        "--near", "500", "--far", "4000", environment={**os.environ, "PATH": self.folder}, browser=())
        self.addCleanup(recorded.end)
        said = pathlib.Path(recorded.errors.name).read_text
        wait_until(lambda: said() == "vergence view: there is no xdg-open: open the address in a "
                                     "browser\n", said)
        done = subprocess.run([VERGENCE, "view", os.path.join(view.out, "files", session), "--calibration", "absent"],
                              capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual((done.returncode, done.stderr), (3, "vergence view: absent: No such file or directory\n"))
        self.browser.open(recorded.url, f"{NUMBER} > 0")
        self.assertEqual(self.browser.evaluate("document.getElementById('far').value"), "4000")
        self.until("/pair 1 of 1/.test(document.getElementById('pace').textContent)")
        self.assertTrue(self.browser.evaluate("document.getElementById('controls').closest('section').hidden"))

    def show_pair(self, pair):
        for path, image in zip(self.pictures, pair):
            show(path, cv2.cvtColor(image, cv2.COLOR_GRAY2RGB))

    def test_the_guide_leads_to_a_calibration_that_is_used(self):
        view = self.started("--cameras", "/dev/video0,/dev/video1")
        self.opened(view)
        self.click("#board-find")
        state = "document.getElementById('board-state').textContent"
        self.until(f"/left: .*right: .*0 of 15 views; next: hold/.test({state})")
        for number, pair in enumerate(boards.pairs(), 1):
            shown = view.picture()[0]
            self.show_pair(pair)
            # Frames that were under way show the pose before.
            self.until(f"{NUMBER} > {shown + 3} && /found in both/.test({state})")
            wait_until(lambda: self.captured_view(number, state), lambda: self.text("log"))
        self.click("#board-calibrate")
        self.until("/^calibration set/.test(document.querySelector('#log li:last-child code').textContent)"
                   " && !document.querySelector('#log li:last-child .answer').textContent.startsWith('…')")
        self.assertIn("baseline", self.text("log"))
        self.click("[data-mode=depth]")
        self.until("Number(document.getElementById('stage').dataset.depths || 0) > 1")
        self.assertIn("rows agree", self.text("depth-state"))

    def captured_view(self, number, state):
        """Whether the view is there; one during which a frame changed is refused and repeated."""
        done = "document.querySelectorAll('#log li').length"
        count = self.browser.evaluate(done)
        self.click("#board-capture")
        self.until(f"{done} > {count} && "
                   "!document.querySelector('#log li:last-child .answer').textContent.startsWith('…')")
        self.browser.settle()
        return self.browser.evaluate(f"/ {number} of 15 views/.test({state})")

    def test_a_camera_that_vanishes_and_a_daemon_that_ends_are_reported(self):
        self.plug("plug")
        self.serve(self.cameras() + f"plug /dev/video1 {self.place('plug')}\n", "profile=two-cameras")
        self.asked("bringup")
        view = View(self.folder, f"unix:{self.path}")
        self.addCleanup(view.end)
        self.opened(view)
        self.plug("plug", False)
        self.until("/right camera: it is gone .*bringup/.test(document.getElementById('alert').textContent)")
        self.plug("plug")
        self.click("[data-run='Bring up']")
        self.until("document.getElementById('alert').hidden")
        self.newer()
        self.end(type(self).daemon)
        self.until("/connection lost|no vergenced|cannot connect|No such file/"
                   ".test(document.getElementById('alert').textContent)")
        self.start()
        self.until("/bringup/.test(document.getElementById('alert').textContent)")

    def test_one_line_says_what_is_wrong(self):
        for words, expected in ((("--cameras", "/dev/video7,/dev/video8"), 0),
                                (("unix:absent.sock",), 3), (("absent",), 3), (("files/absent",), 3),
                                (("--cameras", "a,b", "unix:absent.sock"), 2),
                                (("unix:absent.sock", "--out", __file__), 1),
                                (("--cameras", "/dev/video0"), 3), (("--near", "5"), 2)):
            if expected == 0:
                view = self.started(*words)
                status, _, data = view.request("GET", view.path + "picture?after=0")
                self.assertEqual(status, 503, data)
                self.assertIn(b"bringup", data)
                continue
            done = subprocess.run([VERGENCE, "view", *words, "--no-browser"], capture_output=True,
                                  text=True, timeout=TIMEOUT_S, cwd=self.folder)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (expected, 1), done.stderr)
            self.assertEqual("neither a recorded session nor" in done.stderr, words[0].endswith("absent"))

    def test_a_daemon_that_refuses_is_quoted(self):
        with socket.create_server(("127.0.0.1", 0)) as server:
            view = subprocess.Popen(
                [VERGENCE, "view", f"tcp:127.0.0.1:{server.getsockname()[1]}", "--no-browser"],
                stderr=subprocess.PIPE, text=True, cwd=self.folder)
            with server.accept()[0] as line:
                line.sendall(b"ERR REFUSED no token\n")
                said = view.communicate(timeout=TIMEOUT_S)[1]
        self.assertEqual((view.returncode, said), (3, "vergence view: ERR REFUSED no token\n"))


if __name__ == "__main__":
    unittest.main()
