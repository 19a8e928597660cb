# SPDX-License-Identifier: Apache-2.0
"""Pairs to be measured: those of a session's directory, as daemon/session.md describes it, or a
folder with left.*, right.* and a calibration."""
import os
import pathlib
import re
import stat
import zlib

INDEX, CRC_DIGITS = "session.index", 8
IMAGES = (".png", ".pgm", ".ppm", ".pnm", ".tif", ".tiff", ".jpg", ".raw")
CALIBRATIONS = ("calibration.txt", "rig.calibration", "calib.txt", "calib_cam_to_cam.txt")


class Unusable(Exception):
    """A directory or file that cannot be used; the text names it."""


class Pair:
    def __init__(self, name, left, right, arguments):
        self.name, self.left, self.right, self.arguments = name, left, right, arguments


def lines_of(path):
    """The index's events without their CRC; a last line that is not whole counts as none."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise Unusable(f"{path}: cannot be read ({error.strerror})") from error
    crc, lines = 0, data.split(b"\n")
    for number, line in enumerate(lines[:-1], 1):
        body, told = line[:-CRC_DIGITS - 1], line[-CRC_DIGITS - 1:]
        if told != b" %08x" % zlib.crc32(body, crc):
            if number == len(lines) - 1:
                return
            raise Unusable(f"{path}: line {number} is not what was written there")
        crc = zlib.crc32(line + b"\n", crc)
        yield body.decode("ascii")


def checked(path, crc):
    """The path of a file whose CRC-32 must be this."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise Unusable(f"{path}: cannot be read ({error.strerror})") from error
    if zlib.crc32(data) != crc:
        raise Unusable(f"{path}: is not what was recorded")
    return path


def pairs_of_session(folder):
    calibration = None
    for line in lines_of(folder / INDEX):
        kind, *words = line.split(" ")
        keys = dict(word.split("=", 1) for word in words)
        if kind == "begin" and keys["version"] != "1":
            raise Unusable(f"{folder}: was made by a newer version")
        if kind == "calibration":
            calibration = checked(folder / f"calibration-{keys['file']}.txt", int(keys["file"], 16))
        if kind == "pair":
            if calibration is None:
                raise Unusable(f"{folder}: pair {keys['number']} has no calibration")
            # Files of the reference are called by it.
            if not re.fullmatch("[0-9]+", keys["number"]):
                raise Unusable(f"{folder}: pair {keys['number']}: is no number")
            frames = [checked(folder / f"frame-{keys[side]}.pnm", int(keys[side], 16))
                      for side in ("left_frame", "right_frame")]
            bayer = "grbg" if keys["left_layout"] == "grbg" else "none"
            yield Pair(f"pair {keys['number']}", *frames,
                       ["--calibration", calibration, "--bayer", bayer])


def pair_of_folder(folder):
    def only(stem):
        found = [folder / (stem + end) for end in IMAGES if (folder / (stem + end)).is_file()]
        if len(found) != 1:
            raise Unusable(f"{folder}: holds neither a session ({INDEX}) nor exactly one {stem} "
                           "image")
        return found[0]
    left, right = only("left"), only("right")
    for name in CALIBRATIONS:
        if (folder / name).is_file():
            return Pair("pair", left, right, ["--calibration", folder / name])
    raise Unusable(f"{folder}: holds no calibration ({', '.join(CALIBRATIONS)})")


def need_directory(folder):
    try:
        mode = os.stat(folder).st_mode
    except FileNotFoundError as error:
        raise Unusable(f"{folder}: there is no such directory") from error
    if not stat.S_ISDIR(mode):
        raise Unusable(f"{folder}: is no directory")


def pairs_of(folder):
    folder = pathlib.Path(folder)
    is_session = (folder / INDEX).exists()
    pairs = list(pairs_of_session(folder)) if is_session else [pair_of_folder(folder)]
    if not pairs:
        raise Unusable(f"{folder}: holds no pair")
    return pairs
