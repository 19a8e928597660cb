# SPDX-License-Identifier: Apache-2.0
"""A headless chromium driven over its debugging pipe: no driver program, no network port.

Protocol: https://chromedevtools.github.io/devtools-protocol/ (messages are JSON, each ended by a
zero byte, on file descriptors 3 and 4 of the browser).
"""
import base64
import json
import os
import select
import shutil
import signal
import subprocess
import tempfile
import time


class Browser:
    """One page at a time; `events` collects the browser's reports since the page was opened."""

    def __init__(self, width=1400, height=1000, arguments=()):
        self.profile = tempfile.TemporaryDirectory(prefix="vergence-browser-",
                                                   ignore_cleanup_errors=True)
        to_browser, self.write_end = os.pipe()
        self.read_end, from_browser = os.pipe()
        command = [shutil.which("chromium") or "chromium", "--headless=new", "--no-sandbox",
                   "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                   "--remote-debugging-pipe", "--no-first-run", "--disable-extensions",
                   "--disable-background-networking", "--disable-component-update",
                   f"--user-data-dir={self.profile.name}", f"--window-size={width},{height}",
                   *arguments, "about:blank"]

        def place_pipes():
            # The two ends must become 3 and 4, regardless of their current numbers.
            high_in, high_out = os.dup(to_browser), os.dup(from_browser)
            os.dup2(high_in, 3)
            os.dup2(high_out, 4)
            os.setsid()

        self.process = subprocess.Popen(command, preexec_fn=place_pipes, close_fds=False,
                                        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.buffer = b""
        self.number = 0
        self.events = []
        self.session = None
        target = next(t for t in self.call("Target.getTargets")["targetInfos"]
                      if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"],
                                 flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.resize(width, height)

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()
        os.close(self.write_end)
        os.close(self.read_end)
        self.profile.cleanup()

    def call(self, method, timeout_s=60, **parameters):
        """Sends a command and returns its result; keeps events that arrive meanwhile."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.write_end, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + timeout_s
        while True:
            answer = self._receive(deadline)
            if answer.get("id") == message["id"]:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def _receive(self, deadline):
        while b"\0" not in self.buffer:
            left_s = deadline - time.monotonic()
            if left_s <= 0 or not select.select([self.read_end], [], [], left_s)[0]:
                raise TimeoutError("the browser does not answer")
            block = os.read(self.read_end, 1 << 20)
            if not block:
                raise RuntimeError("the browser ended")
            self.buffer += block
        text, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(text)

    def resize(self, width, height, dark=False, touch=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=touch)
        self.call("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def open(self, path, ready="document.readyState === 'complete'", timeout_s=60):
        """Loads a file, or an address, and waits until the expression `ready` is true."""
        self.events.clear()
        self.call("Page.navigate",
                  url=path if "://" in str(path) else "file://" + os.path.abspath(path))
        deadline = time.monotonic() + timeout_s
        # There may be no document while the page is replaced.
        while not self.evaluate(f"document.documentElement !== null && ({ready})"):
            if time.monotonic() > deadline:
                raise TimeoutError(f"not ready: {ready}; {self.complaints()}")
            self.settle()

    def evaluate(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True,
                           awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(json.dumps(result["exceptionDetails"]))
        return result["result"].get("value")

    def settle(self):
        """Waits until the browser has drawn twice."""
        self.call("Runtime.evaluate", awaitPromise=True, expression=(
            "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))"))

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, x0, y0, x1, y1):
        self.mouse("mousePressed", x0, y0, button="left", buttons=1, clickCount=1)
        for i in range(1, 6):
            self.mouse("mouseMoved", x0 + (x1 - x0) * i / 5, y0 + (y1 - y0) * i / 5,
                       button="left", buttons=1)
        self.mouse("mouseReleased", x1, y1, button="left", clickCount=1)

    def click(self, x, y):
        self.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
        self.mouse("mouseReleased", x, y, button="left", clickCount=1)

    def box(self, selector):
        """Left, top, width and height of an element in the window, scrolled into view."""
        return self.evaluate(
            "(() => { const e = document.querySelector(%s); e.scrollIntoView({block: 'center'});"
            " const b = e.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()"
            % json.dumps(selector))

    def screenshot(self, path=None, clip=None, whole=False):
        """PNG bytes of the window, of a box (left, top, width, height) or of the whole page."""
        parameters = {"format": "png", "captureBeyondViewport": whole}
        if clip:
            parameters["clip"] = dict(zip(("x", "y", "width", "height"), clip), scale=1)
        png = base64.b64decode(self.call("Page.captureScreenshot", **parameters)["data"])
        if path:
            with open(path, "wb") as file:
                file.write(png)
        return png

    def complaints(self):
        """Errors and exceptions caused by the page."""
        found = []
        for event in self.events:
            parameters = event.get("params", {})
            if event.get("method") == "Runtime.exceptionThrown":
                found.append(json.dumps(parameters["exceptionDetails"]))
            elif event.get("method") == "Runtime.consoleAPICalled":
                if parameters["type"] in ("error", "assert"):
                    found.append(json.dumps(parameters["args"]))
            elif event.get("method") == "Log.entryAdded":
                if parameters["entry"]["level"] == "error":
                    found.append(parameters["entry"]["text"])
        return found

    def requests(self):
        """URLs of all requests but those for data inside the page."""
        urls = [event["params"]["request"]["url"] for event in self.events
                if event.get("method") == "Network.requestWillBeSent"]
        return [url for url in urls if not url.startswith("data:")]
