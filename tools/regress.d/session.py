# SPDX-License-Identifier: Apache-2.0
"""The pairs to measure: those of a session directory (daemon/session/session.md), or a folder with left.*,
right.* and a calibration."""
import os
import pathlib
import re
import stat
import zlib

INDEX, CRC_DIGITS = "session.index", 8
VERSIONS = ("1", "2", "3")  # of the index, as daemon/session/session.md has them
IMAGES = (".png", ".pgm", ".ppm", ".pnm", ".tif", ".tiff", ".jpg", ".raw")
CALIBRATIONS = ("calibration.txt", "rig.calibration", "calib.txt", "calib_cam_to_cam.txt")


class Unusable(Exception):
    """A directory or file is unusable; the text names it."""


def at_once(path, flags):
    return os.open(path, flags | os.O_NONBLOCK | os.O_NOCTTY)


def read_regular(path):
    """All bytes of a regular file. Anything else, such as a pipe, is rejected without blocking."""
    try:
        with open(path, "rb", opener=at_once) as file:
            if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                return file.read()
    except IsADirectoryError:
        pass
    except OSError as error:
        raise Unusable(f"{path}: cannot read ({error.strerror})") from error
    raise Unusable(f"{path}: not a regular file")


class Pair:
    def __init__(self, name, left, right, arguments):
        self.name, self.left, self.right, self.arguments = name, left, right, arguments


class Event(dict):
    """A line of the index: its `kind`, and its keys with their values."""

    def __init__(self, where, words):
        self.where, (self.kind, *pairs) = where, words
        for pair in pairs:
            key, mark, value = pair.partition("=")
            if not mark:
                raise Unusable(f"{where}: not KEY=VALUE: {pair}")
            self[key] = value

    def __missing__(self, key):
        raise Unusable(f"{self.where}: no {key}")

    def digits(self, key):
        """The CRC-32 in the name of a file."""
        if not re.fullmatch("[0-9a-f]{%d}" % CRC_DIGITS, self[key]):
            raise Unusable(f"{self.where}: {key} is {self[key]} (expected {CRC_DIGITS} digits)")
        return self[key]


def events_of(path):
    """The index's lines, without an incomplete last one."""
    crc, lines = 0, read_regular(path).split(b"\n")
    for number, line in enumerate(lines[:-1], 1):
        body, reported = line[:-CRC_DIGITS - 1], line[-CRC_DIGITS - 1:]
        if reported != b" %08x" % zlib.crc32(body, crc):
            if number == len(lines) - 1:
                return
            raise Unusable(f"{path}: line {number} is damaged")
        crc = zlib.crc32(line + b"\n", crc)
        try:
            yield Event(f"{path}: line {number}", body.decode("ascii").split(" "))
        except UnicodeDecodeError as error:
            raise Unusable(f"{path}: line {number} is not text") from error


def checked(folder, event, key, name):
    """The path of the file of an event: `name` with the star replaced by the digits of its CRC-32,
    which is checked."""
    digits = event.digits(key)
    path = folder / name.replace("*", digits)
    if "%08x" % zlib.crc32(read_regular(path)) != digits:
        raise Unusable(f"{path}: damaged (wrong CRC-32)")
    return path


def pairs_of_session(folder):
    calibration = None
    for event in events_of(folder / INDEX):
        if event.kind == "begin" and event["version"] not in VERSIONS:
            raise Unusable(f"{folder}: made by a newer version")
        if event.kind == "calibration":
            calibration = checked(folder, event, "file", "calibration-*.txt")
        if event.kind == "pair":
            number = event["number"]
            if calibration is None:
                raise Unusable(f"{folder}: pair {number} has no calibration")
            # Files of the reference are named after it.
            if not re.fullmatch("[0-9]+", number):
                raise Unusable(f"{folder}: pair {number}: not a number")
            frames = [checked(folder, event, side, "frame-*.pnm")
                      for side in ("left_frame", "right_frame")]
            bayer = "grbg" if event["left_layout"] == "grbg" else "none"
            yield Pair(f"pair {number}", *frames, ["--calibration", calibration, "--bayer", bayer])


def need_regular(path):
    if not path.is_file():
        raise Unusable(f"{path}: not a regular file")
    return path


def pair_of_folder(folder):
    def only(stem):
        found = [folder / (stem + end) for end in IMAGES if (folder / (stem + end)).exists()]
        if len(found) != 1:
            raise Unusable(f"{folder}: neither a session ({INDEX}) nor exactly one {stem} image")
        return need_regular(found[0])
    left, right = only("left"), only("right")
    for name in CALIBRATIONS:
        if (folder / name).exists():
            return Pair("pair", left, right, ["--calibration", need_regular(folder / name)])
    raise Unusable(f"{folder}: no calibration ({', '.join(CALIBRATIONS)})")


def need_directory(folder):
    try:
        mode = os.stat(folder).st_mode
    except FileNotFoundError as error:
        raise Unusable(f"{folder}: no such directory") from error
    if not stat.S_ISDIR(mode):
        raise Unusable(f"{folder}: not a directory")


def pairs_of(folder):
    folder = pathlib.Path(folder)
    is_session = (folder / INDEX).exists()
    pairs = list(pairs_of_session(folder)) if is_session else [pair_of_folder(folder)]
    if not pairs:
        raise Unusable(f"{folder}: no pair in the session")
    return pairs
