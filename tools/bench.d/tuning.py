#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What each number of the matcher, a quarter lower and higher, and each rule of acceptance, left
out, does to mean bad-1.0 of recorded pairs, to the share of kept pixels of rendered views that are
off by more than 1 px, and to that of the textured pixels of the object in a view's name that are
kept and right. Differences in percentage points; the preset best.

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
NEVER = 1 << 20
VISIBLE, VISIBLE_TEXTURED, TEXTURED = 255, 254, 128
RULE = re.compile(r'\{"([^"]+)", MATCH_\w+, (true|false), TUNE_(\w+), REASON')  # of match_rules
PARTS = {  # of what rules measure: name, the number that turns it off
    "any cost among accepted pixels": "SHARE_ANY_COST", "depth edges": "DEPTH_EDGE_PX",
    "upright structure": "UPRIGHT", "coarse texture with slopes": "STRONG_COARSE",
}


def rules_of(text):
    """Names, and the numbers that turn a rule, or a part of it, off."""
    numbers = {match[2]: int(match[3]) for match in NUMBER.finditer(text)}
    rules = {name: {limit: NEVER if at_most == "true" else 0}
             for name, at_most, limit in RULE.findall(text)}
    rules["margin"]["MARGIN_LEAST"] = 0
    rules["margin by contrast"] = {"MARGIN_LEAST": numbers["MARGIN_MIN"]}
    return {**rules, **{name: {number: NEVER} for name, number in PARTS.items()}}


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


def hh4_right(folder, meta, truth, textured):
    """Percentage of textured pixels that OpenCV's HH4 keeps and gets right (bench_opencv.cpp)."""
    first, end = meta["disparity_search"]
    count = (end - first + 15) // 16 * 16
    before, after = max(first + count, 0), max(-first, 0)
    images = [cv2.copyMakeBorder(cv2.imread(str(folder / f"{side}.png"), cv2.IMREAD_GRAYSCALE), 0, 0,
                                 before, after, cv2.BORDER_REPLICATE) for side in ("left", "right")]
    matcher = cv2.StereoSGBM_create(first, count, 3, 72, 288, 1, 31, 10, 100, 2,
                                    cv2.STEREO_SGBM_MODE_HH4)
    found = matcher.compute(*images)[:, before:before + truth.shape[1]]
    right = (found >= 16 * first) & (abs(found / 16 - truth) <= 1)
    return 100 * right[textured].mean()


def prepare(folder, out):
    """Writes the arrays of a pair; returns its line of the list, and of a view what HH4 has right."""
    meta = json.loads((folder / "meta.json").read_text(encoding="utf-8"))
    truth = read_pfm(folder / "disparity.pfm")
    known = truth[numpy.isfinite(truth)]
    mask = cv2.imread(str(folder / "mask.png"), cv2.IMREAD_GRAYSCALE) \
        if (folder / "mask.png").exists() else visible(truth)
    is_view = "part" in meta
    rival = None
    if is_view:
        subject = folder.name.rsplit("_", 1)[0]
        regions = cv2.imread(str(folder / "regions.png"), cv2.IMREAD_GRAYSCALE)
        textured = (mask == VISIBLE) & (regions > TEXTURED)
        if subject in meta["regions"]:
            textured &= regions == TEXTURED + meta["regions"].index(subject) + 1
        rival = hh4_right(folder, meta, truth, textured)
        mask = numpy.where(textured, VISIBLE_TEXTURED, mask).astype("u1")
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
    return f"{out} {width} {height} {first} {end - first} {int(is_view)} {int(whole)}\n", rival


class Trial:
    """Builds the matcher with changed numbers, and measures."""

    def __init__(self, firmware, folder, pairs):
        self.firmware, self.folder = firmware, folder
        self.text = (firmware / "stereo/match/tuning.h").read_text(encoding="utf-8")
        self.list = folder / "list"
        lines = [prepare(pair, folder / f"{i}.raw") for i, pair in enumerate(pairs)]
        self.names = [pair.name for pair in pairs]
        self.rivals = [rival for _, rival in lines]
        self.list.write_text("".join(line for line, _ in lines), encoding="utf-8")
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
        """The sources that use one of the numbers, also by a header or a rule."""
        limits = {limit for _, _, limit in RULE.findall(self.text)}
        rules = r"|\bmatch_(?:rules|accepts)\b" if limits & set(names) else ""
        pattern = re.compile(rf"\bTUNE_(?:{'|'.join(names)})\b{rules}")
        used = {path for path in glob.glob(str(self.firmware / "stereo/match/*.[ch]"))
                if not path.endswith("tuning.h")
                and pattern.search(pathlib.Path(path).read_text(encoding="utf-8"))}
        if any(path.endswith("state.h") for path in used):
            return [path for path in self.objects if "/match/" in path]
        if any(path.endswith(".h") for path in used):
            used |= {path for path in self.objects if "/match/kernels" in path}
        return [path for path in used if path in self.objects]

    def measure(self, changes):
        """The figures of each pair and, in the last line, of all; None: does not compile."""
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
        return [[float(word) for word in line.split()] for line in done.stdout.splitlines()]

    def differences(self, changes, base):
        result = self.measure(changes)
        return "-" if result is None else \
            " ".join(f"{after - before:+.2f}" for before, after in zip(base, result[-1]))


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
        *each, base = trial.measure({})
        for name, rival, (wrong, right) in zip(trial.names, trial.rivals, each):
            print(f"{name:16} bad-1.0 {wrong:.2f} %" if rival is None else
                  f"{name:16} kept and wrong {wrong:.2f} %, right of textured {right:.2f} %, "
                  f"HH4 {rival:.2f} %")
        print(f"bad-1.0 {base[0]:.2f} %, kept and wrong {base[1]:.2f} %, right of textured "
              f"{base[2]:.2f} %; differences in points, of each of the three", flush=True)
        for name, changes in rules_of(trial.text).items():
            if arguments.only.search(name):
                print(f"without {name:34} {trial.differences(changes, base)}", flush=True)
        found = {}
        for match in NUMBER.finditer(trial.text):
            name, value = match[2], int(match[3])
            if OTHERS.search(name) or not arguments.only.search(name):
                continue
            step = max(round(value / 4), 1)
            most = 255 if name.startswith("SHARE") else NEVER  # a share is at most 255
            lower, higher = (trial.differences({name: min(value + sign * step, most)}, base)
                             for sign in (-1, 1))
            found[name] = f"{lower}, {higher}"
            print(f"{name:20} {value:6} -{step}: {lower:16} +{step}: {higher}", flush=True)
        if arguments.write:
            path = arguments.firmware / "stereo/match/tuning.h"
            path.write_text(NUMBER.sub(
                lambda m: f"{m[1]}{m[3]},{m[4]} | {found[m[2]]}" if m[2] in found else m[0],
                trial.text), encoding="utf-8")


if __name__ == "__main__":
    main()
