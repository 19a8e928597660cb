# SPDX-License-Identifier: Apache-2.0
"""OpenCV's matchers of a cv2 module that is not the system's, driven over standard input and output.

usage: opencv_worker.py FOLDER_OF_CV2

Answers each line of standard input with a line that begins with "ok" or "error":
  make ID WIDTH HEIGHT {"mode", "block", ...}   and both images' bytes; makes a matcher
  first ID                                      its first run on one thread: bytes of memory it took
  run ID THREADS                                one run: milliseconds on the clock, of all processors
  result ID                                     the map of the last run: its 16-bit values follow
  drop ID                                       frees it
"""
import ctypes
import json
import os
import sys
import time

import numpy

FOLDER = sys.argv[1]
if not os.path.isdir(os.path.join(FOLDER, "cv2")):
    sys.exit(print(f"error no module cv2 in {FOLDER}"))  # otherwise the system's would be found
sys.path.insert(0, FOLDER)
import cv2  # pylint: disable=wrong-import-position

MODES = {"SGBM": cv2.StereoSGBM_MODE_SGBM, "SGBM HH": cv2.StereoSGBM_MODE_HH,
         "SGBM HH4": cv2.StereoSGBM_MODE_HH4, "SGBM 3-way": cv2.StereoSGBM_MODE_SGBM_3WAY}


def matcher_of(setting):
    """The same calls as in bench_opencv.cpp; speckle_step is in the matcher's own unit."""
    if setting["mode"] == "StereoBM":
        matcher = cv2.StereoBM_create(setting["count"], setting["block"])
    else:
        matcher = cv2.StereoSGBM_create(0, setting["count"], setting["block"], setting["p1"],
                                        setting["p2"], mode=MODES[setting["mode"]])
    matcher.setMinDisparity(setting["min"])
    matcher.setPreFilterCap(setting["prefilter_cap"])
    matcher.setUniquenessRatio(setting["uniqueness"])
    matcher.setDisp12MaxDiff(1)
    matcher.setSpeckleWindowSize(setting["speckle"])
    matcher.setSpeckleRange(setting["speckle_step"])
    return matcher


class Matcher:
    def __init__(self, setting, left, right):
        self.matcher, self.left, self.right = matcher_of(setting), left, right
        self.disparity = numpy.zeros(left.shape, numpy.int16)

    def run(self):
        self.disparity = self.matcher.compute(self.left, self.right, self.disparity)


def set_threads(count):
    """Starts the threads of a new count before anything is timed."""
    if cv2.getNumThreads() != count:
        cv2.setNumThreads(count)
        cv2.GaussianBlur(numpy.zeros((512, 512), numpy.uint8), (9, 9), 2)


def resident_bytes(name):
    with open("/proc/self/status", encoding="ascii") as file:
        for line in file:
            if line.startswith(name + ":"):
                return 1024 * int(line.split()[1])
    raise RuntimeError(f"/proc/self/status has no {name}")


def first_run_bytes(matcher):
    """Growth of the process at its peak. The peak is first reset to the current size, and free heap
    from earlier work is returned, or the run would be served from it."""
    ctypes.CDLL(None).malloc_trim(0)
    with open("/proc/self/clear_refs", "w", encoding="ascii") as file:
        file.write("5")
    before = resident_bytes("VmRSS")
    matcher.run()
    return max(resident_bytes("VmHWM") - before, 0)


def timed_run(matcher):
    processors, clock = time.process_time(), time.perf_counter()
    matcher.run()
    wall = time.perf_counter() - clock
    return f"{1e3 * wall:.6f} {1e3 * (time.process_time() - processors):.6f}"


def image_from(stream, width, height):
    pixels = stream.read(width * height)
    if len(pixels) != width * height:
        raise RuntimeError("the image is cut short")
    return numpy.frombuffer(pixels, numpy.uint8).reshape(height, width)


class Worker:
    def __init__(self, stream):
        self.stream, self.matchers = stream, {}

    def answer(self, words):
        """The reply's line and the bytes after it."""
        command, number = words[0], words[1]
        if command == "make":
            width, height = int(words[2]), int(words[3])
            left, right = (image_from(self.stream, width, height) for _ in range(2))
            self.matchers[number] = Matcher(json.loads(" ".join(words[4:])), left, right)
            return "", b""
        if command == "drop":
            del self.matchers[number]
            return "", b""
        matcher = self.matchers[number]
        if command == "first":
            set_threads(1)
            return str(first_run_bytes(matcher)), b""
        if command == "run":
            set_threads(int(words[2]))
            return timed_run(matcher), b""
        if command == "result":
            return "", matcher.disparity.tobytes()
        raise ValueError(f"unknown command {command}")


def main():
    replies = sys.stdout.buffer
    worker = Worker(sys.stdin.buffer)
    replies.write(f"ok {cv2.__version__}\n".encode())
    replies.flush()
    for line in sys.stdin.buffer:
        try:
            text, content = worker.answer(line.decode().split())
            replies.write(f"ok {text}\n".encode() + content)
        except Exception as error:  # any exception of OpenCV is reported to the other side
            replies.write(f"error {type(error).__name__} {' '.join(str(error).split())}\n".encode())
        replies.flush()


if __name__ == "__main__":
    main()
