#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What each number of the matcher, a quarter lower and higher, and each rule of acceptance, left
out, does to mean bad-1.0 of recorded pairs and to the share of kept pixels of rendered views that
are off by more than 1 px. Differences in percentage points; the preset best.

usage: tuning.py FIRMWARE DIR... [--only REGEX] [--write]

  --only REGEX  only numbers and rules whose name matches
  --write       also writes the differences of numbers into FIRMWARE/stereo/match/tuning.h
"""
import argparse
import glob
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import cv2
import numpy

HERE = pathlib.Path(__file__).resolve().parent
FLAGS = ["gcc", "-std=c11", "-O2", "-ffp-contract=off"]
LEVELS = {"kernels_avx2.c": ["-mavx2"], "kernels_sse41.c": ["-msse4.1"]}
NUMBER = re.compile(r"^( *TUNE_(\w+) = )(\d+),( *// [^|\n]*?)(?: *\| .*)?$", re.MULTILINE)
# Not measured here: other presets, sizes that others must divide, and what takes the memory.
OTHERS = re.compile(r"TILES_BETWEEN|BANDS_EACH|PAPER|REPEAT|CONTRAST_COLUMNS|SEARCH_ALL|"
                    r"SLOPE_(AROUND|STEP)$|ROW_STEP|WINDOW")
NEVER, HIGHEST = 1 << 20, 255
RULES = {  # name: the numbers that turn it off
    "contrast": {"CONTRAST_MIN": 0}, "margin": {"MARGIN_MIN": 0, "MARGIN_LEAST": 0},
    "cost": {"COST_MAX": HIGHEST, "COST_MAX_SMOOTHED": HIGHEST, "COST_MAX_STRONG": HIGHEST},
    "margin by contrast": {"MARGIN_LEAST": 23}, "support of costly ones": {"SUPPORT_COST": NEVER},
    "support of those with a rival": {"SUPPORT_RIVAL": NEVER},
    "clear mean margin": {"MEAN_MARGIN_CLEAR": HIGHEST}, "share with texture": {"SHARE_REACHED": 0},
    "some texture": {"TEXTURED_FAR": NEVER}, "little texture": {"TEXTURED_FEW": NEVER},
    "edge along the rows": {"TEXTURED_EDGE": NEVER}, "coarse texture": {"STRONG_COARSE": 0},
    "no texture at depth edges": {"DEPTH_EDGE_PX": NEVER}, "upright structure": {"UPRIGHT": NEVER},
    "pixels not seen by both": {"HIDDEN_STEP_PX": NEVER}, "hidden pixels": {"HIDDEN_BEFORE": 17},
    "onset of an outline": {"ONSET_PX": 0}, "islands": {"ISLAND_PX": 0},
}


def read_pfm(path):
    with open(path, "rb") as file:
        file.readline()
        width, height = map(int, file.readline().split())
        order = "<f4" if float(file.readline()) < 0 else ">f4"
        values = numpy.frombuffer(file.read(), order).reshape(height, width)
    return numpy.flipud(values).astype("f4")


def visible(truth):
    """255 where no nearer pixel of the row has the same place in the right image, else 128."""
    mask = numpy.zeros(truth.shape, "u1")
    for row, seen in zip(truth, mask):
        nearest = {}
        known = [(x, d) for x, d in enumerate(row) if numpy.isfinite(d)]
        for x, d in known:
            nearest[round(x - d)] = max(d, nearest.get(round(x - d), d))
        for x, d in known:
            seen[x] = 255 if x >= d and d >= nearest[round(x - d)] - 1 else 128
    return mask


def prepare(folder, out):
    """Writes the arrays of a pair; returns its line of the list."""
    meta = json.loads((folder / "meta.json").read_text(encoding="utf-8"))
    truth = read_pfm(folder / "disparity.pfm")
    known = truth[numpy.isfinite(truth)]
    mask = cv2.imread(str(folder / "mask.png"), cv2.IMREAD_GRAYSCALE) \
        if (folder / "mask.png").exists() else visible(truth)
    images = [cv2.imread(str(folder / f"{side}.png")) for side in ("left", "right")]
    with open(out, "wb") as file:
        file.write(truth.tobytes())
        for image in images:
            file.write(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY).tobytes())
        for image in images:
            file.write(cv2.cvtColor(image, cv2.COLOR_BGR2RGB).tobytes())
        file.write(mask.tobytes())
    first, end = meta["disparity_search"]
    whole = bool(numpy.all(known == numpy.rint(known)))
    height, width = truth.shape
    return f"{out} {width} {height} {first} {end - first} {int('part' in meta)} {int(whole)}\n"


class Trial:
    """Builds the matcher with changed numbers, and measures."""

    def __init__(self, firmware, folder, pairs):
        self.firmware, self.folder = firmware, folder
        self.text = (firmware / "stereo/match/tuning.h").read_text(encoding="utf-8")
        self.list = folder / "list"
        self.list.write_text("".join(prepare(pair, folder / f"{i}.raw")
                                     for i, pair in enumerate(pairs)), encoding="utf-8")
        sources = [path for part in ("core", "stereo/image", "stereo/match")
                   for path in sorted(glob.glob(str(firmware / part / "*.c")))]
        self.objects = {path: self.compile(path) for path in [*sources, str(HERE / "tuning.c")]}

    def compile(self, source, include=()):
        name = os.path.basename(source)
        target = tempfile.mktemp(dir=self.folder, suffix=".o")
        subprocess.run([*FLAGS, *LEVELS.get(name, []), *include, f"-I{self.firmware}", "-c", source,
                        "-o", target], check=True)
        return target

    def users(self, names):
        """The sources that use one of the numbers, also by a header."""
        pattern = re.compile(rf"\bTUNE_(?:{'|'.join(names)})\b")
        used = {path for path in glob.glob(str(self.firmware / "stereo/match/*.[ch]"))
                if not path.endswith("tuning.h")
                and pattern.search(pathlib.Path(path).read_text(encoding="utf-8"))}
        if any(path.endswith("state.h") for path in used):
            return [path for path in self.objects if "/match/" in path]
        if any(path.endswith(".h") for path in used):
            used |= {path for path in self.objects if "/match/kernels" in path}
        return [path for path in used if path in self.objects]

    def measure(self, changes):
        """bad-1.0 of the recorded pairs and kept-and-wrong of the views; None: does not compile."""
        text = NUMBER.sub(lambda m: f"{m[1]}{changes.get(m[2], m[3])},", self.text)
        include = self.folder / "include"
        (include / "stereo/match").mkdir(parents=True, exist_ok=True)
        (include / "stereo/match/tuning.h").write_text(text, encoding="utf-8")
        try:
            own = {path: self.compile(path, [f"-I{include}"]) for path in self.users(changes)} \
                if changes else {}
        except subprocess.CalledProcessError:
            return None
        program = self.folder / "tuning"
        subprocess.run([*FLAGS, *{**self.objects, **own}.values(), "-o", program, "-lm"], check=True)
        for path in own.values():
            os.remove(path)
        done = subprocess.run([program, self.list], check=True, capture_output=True, text=True)
        return [float(word) for word in done.stdout.split()]

    def differences(self, changes, base):
        result = self.measure(changes)
        return "-" if result is None else \
            " ".join(f"{after - before:+.2f}" for before, after in zip(base, result))


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ", 1)[1])
    parser.add_argument("firmware", type=pathlib.Path)
    parser.add_argument("folders", type=pathlib.Path, nargs="+")
    parser.add_argument("--only", type=re.compile, default=re.compile(""))
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    pairs = [meta.parent for folder in arguments.folders for meta in sorted(folder.rglob("meta.json"))
             if (meta.parent / "disparity.pfm").exists()]
    if not pairs:
        sys.exit("tools/bench: no pairs with disparity.pfm in these folders")
    with tempfile.TemporaryDirectory() as folder:
        trial = Trial(arguments.firmware.resolve(), pathlib.Path(folder), pairs)
        base = trial.measure({})
        print(f"bad-1.0 {base[0]:.2f} %, kept and wrong {base[1]:.2f} %, {len(pairs)} pairs; "
              "differences in points, of each: bad-1.0, kept and wrong", flush=True)
        for name, changes in RULES.items():
            if arguments.only.search(name):
                print(f"without {name:34} {trial.differences(changes, base)}", flush=True)
        found = {}
        for match in NUMBER.finditer(trial.text):
            name, value = match[2], int(match[3])
            if OTHERS.search(name) or not arguments.only.search(name):
                continue
            step = max(round(value / 4), 1)
            lower, higher = (trial.differences({name: value + sign * step}, base) for sign in (-1, 1))
            found[name] = f"{lower}, {higher}"
            print(f"{name:20} {value:6} -{step}: {lower:16} +{step}: {higher}", flush=True)
        if arguments.write:
            path = arguments.firmware / "stereo/match/tuning.h"
            path.write_text(NUMBER.sub(
                lambda m: f"{m[1]}{m[3]},{m[4]} | {found[m[2]]}" if m[2] in found else m[0],
                trial.text), encoding="utf-8")


if __name__ == "__main__":
    main()
