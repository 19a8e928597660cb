# SPDX-License-Identifier: Apache-2.0
"""The pairs of a directory to measure, and the reference kept in its folder regress/.

A directory is a session (daemon/session/session.md) or holds left.*, right.* and a calibration.
regress/ holds options.json, which the user writes, and reference.json: quantiles, shares and the CRC-32 of
each pair's result, a few kB. The maps themselves are in the cache.
"""
import json
import pathlib
import re
import zlib

from result import TOLERANCES

INDEX = "session.index"
IMAGES = (".png", ".pgm", ".ppm", ".pnm", ".tif", ".tiff", ".jpg", ".raw")
CALIBRATIONS = ("calibration.txt", "rig.calibration", "calib.txt", "calib_cam_to_cam.txt")


class Unusable(Exception):
    """A directory or file is unusable; the text names it."""


class Pair:
    def __init__(self, name, left, right, arguments):
        self.name, self.left, self.right, self.arguments = name, left, right, arguments


def events_of(path):
    """The index's lines as kind and {key: value}, without an incomplete last one; every line ends
    with the CRC-32 of all before it."""
    crc, lines = 0, path.read_bytes().split(b"\n")
    for number, line in enumerate(lines[:-1], 1):
        if line[-9:] != b" %08x" % zlib.crc32(line[:-9], crc):
            if number == len(lines) - 1:
                return
            raise Unusable(f"{path}: line {number} is damaged")
        crc = zlib.crc32(line + b"\n", crc)
        kind, *pairs = line[:-9].decode("ascii").split(" ")
        yield kind, dict(pair.split("=", 1) for pair in pairs)


def checked(path, digits):
    """A file whose name holds the CRC-32 of its contents."""
    if f"{zlib.crc32(path.read_bytes()):08x}" != digits:
        raise Unusable(f"{path}: damaged (wrong CRC-32)")
    return path


def pairs_of_session(folder):
    calibration = None
    for kind, event in events_of(folder / INDEX):
        if kind == "calibration":
            calibration = checked(folder / f"calibration-{event['file']}.txt", event["file"])
        if kind == "pair":
            if calibration is None:
                raise Unusable(f"{folder}: pair {event['number']} has no calibration")
            frames = [checked(folder / f"frame-{event[side]}.pnm", event[side])
                      for side in ("left_frame", "right_frame")]
            bayer = "grbg" if event["left_layout"] == "grbg" else "none"
            yield Pair(f"pair {event['number']}", *frames,
                       ["--calibration", calibration, "--bayer", bayer])


def pairs_of(folder):
    if (folder / INDEX).exists():
        pairs = list(pairs_of_session(folder))
        if not pairs:
            raise Unusable(f"{folder}: no pair in the session")
        return pairs
    found = {}
    for stem in ("left", "right"):
        images = [folder / (stem + end) for end in IMAGES if (folder / (stem + end)).exists()]
        if len(images) != 1:
            raise Unusable(f"{folder}: neither a session ({INDEX}) nor exactly one {stem} image")
        found[stem] = images[0]
    calibrations = [folder / name for name in CALIBRATIONS if (folder / name).exists()]
    if not calibrations:
        raise Unusable(f"{folder}: no calibration ({', '.join(CALIBRATIONS)})")
    return [Pair("pair", found["left"], found["right"], ["--calibration", calibrations[0]])]


def read_json(path):
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise Unusable(f"{path}: not JSON ({error})") from error


def read_options(folder):
    """Arguments of vergence reconstruct, and tolerances, which default to 0."""
    path = folder / "regress" / "options.json"
    options = read_json(path) if path.exists() else {}
    tolerance = options.get("tolerance", {})
    unknown = (set(options) - {"arguments", "tolerance"}) | (set(tolerance) - set(TOLERANCES))
    if unknown:
        raise Unusable(f"{path}: unknown key \"{sorted(unknown)[0]}\" (expected arguments or "
                       f"tolerance: {', '.join(TOLERANCES)})")
    return options.get("arguments", []), {name: tolerance.get(name, 0) for name in TOLERANCES}


def load(folder):
    """The contents of reference.json."""
    path = folder / "regress" / "reference.json"
    if not path.exists():
        raise Unusable(f"{folder}: no reference; create one with --accept REASON")
    reference = read_json(path)
    if any("map_crc32" not in pair for pair in reference["pairs"]):
        raise Unusable(f"{path}: of an older tools/regress; replace it with --accept REASON")
    return reference


def save(folder, pairs, acceptance):
    """Replaces the reference; earlier acceptances are kept, as they document the history."""
    where = folder / "regress"
    where.mkdir(exist_ok=True)
    path = where / "reference.json"
    accepted = read_json(path)["accepted"] if path.exists() else []
    # A value each line would hide what changed in a thousand lines.
    text = json.dumps({"accepted": [*accepted, acceptance], "pairs": pairs}, indent=1)
    text = re.sub(r"\[[^][{}\"]*\]", lambda found: " ".join(found[0].split()), text)
    path.write_text(text + "\n", encoding="utf-8")


def folder_of(text):
    folder = pathlib.Path(text)
    if not folder.is_dir():
        raise Unusable(f"{text}: no such directory")
    return folder
