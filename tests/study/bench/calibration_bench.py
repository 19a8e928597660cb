# SPDX-License-Identifier: Apache-2.0
"""Our calibration against OpenCV's and mrcal's on any folder of images.

usage: calibration_bench.py DIR --board CxR --square MM --vergence PROGRAM
                            [--samples DIR] [--cache DIR] [--rounds N] [--only TEXT] [--quick]
                            [--json]

--samples is the data folder of opencv-doc, next to the source of stereo_calib, which is compiled into
--cache.
"""
import argparse
import json
import os
import re
import statistics
import sys
import tempfile

import cv2
import numpy as np
from scipy.optimize import least_squares

import calibration_methods as methods

ENDINGS = (".png", ".jpg", ".jpeg", ".pgm", ".tif", ".tiff", ".bmp")


def find_pairs(folder):
    """Pairs of paths: names or folders that differ only in left and right (or L and R)."""
    sides = ({}, {})
    for where, _, names in sorted(os.walk(folder)):
        for name in sorted(names):
            path = os.path.join(where, name)
            inside = os.path.relpath(path, folder)
            found = re.search(r"(?<![a-z])(left|right|l|r)(?![a-z])", inside, re.IGNORECASE)
            if name.lower().endswith(ENDINGS) and found:
                side = 0 if found[1][0].lower() == "l" else 1
                sides[side][inside[:found.start()] + "*" + inside[found.end():]] = path
    return [(sides[0][key], sides[1][key]) for key in sorted(sides[0].keys() & sides[1].keys())]


def of_one_size(pairs):
    """The pairs with the most common image size: the others are from another camera."""
    sizes = []
    for pair in pairs:
        images = [cv2.imread(path, cv2.IMREAD_GRAYSCALE) for path in pair]
        sizes.append(tuple(None if image is None else image.shape for image in images))
    typical = statistics.mode(sizes) if sizes else None
    return [pair for pair, size in zip(pairs, sizes) if size == typical]


def make_stage(folder, pairs):
    """A folder of links leftNNN and rightNNN, which every program accepts."""
    os.makedirs(folder)
    for number, pair in pairs:
        for side, path in zip(("left", "right"), pair):
            ending = os.path.splitext(path)[1].lower()
            os.symlink(os.path.abspath(path), os.path.join(folder, f"{side}{number:03d}{ending}"))
    return folder


def undistort(points, K, D):
    """Rays x/z, y/z."""
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-12)
    return cv2.undistortPointsIter(points.reshape(-1, 1, 2), np.array(K), np.array(D), None, None,
                                   stop)[:, 0]


def rows_rms(rig, corners, pairs):
    """Vertical disparity after rectification, in px of the raw images, and its count."""
    T = np.asarray(rig["T"], float)
    R = np.asarray(rig["R"], float)
    x = -R.T @ T / np.linalg.norm(T)  # from the left centre to the right one
    z = R[2] + (0, 0, 1)
    z = z - (z @ x) * x
    z /= np.linalg.norm(z)
    rect_left = np.array([x, np.cross(z, x), z])
    rect = (rect_left, rect_left @ R.T)
    f_px = (rig["K"][0][1, 1] + rig["K"][1][1, 1]) / 2
    off = []
    for pair in pairs:
        if not all(name in corners for name in pair):
            continue
        rows = []
        for i, name in enumerate(pair):
            rays = undistort(corners[name], rig["K"][i], rig["D"][i])
            turned = np.column_stack((rays, np.ones(len(rays)))) @ rect[i].T
            rows.append(f_px * turned[:, 1] / turned[:, 2])
        off.append(rows[0] - rows[1])
    return float(np.sqrt(np.nanmean(np.concatenate(off) ** 2))) if off else None


def held_out_errors(rig, corners, pairs, grid):
    """Squared distances of the corners of each pair from where the rig predicts them, with the
    (flat) board at the pose that fits both cameras best."""
    errors = []
    T, R = np.asarray(rig["T"], float), np.asarray(rig["R"], float)
    for pair in pairs:
        if not all(name in corners for name in pair):
            continue
        seen = [corners[name] for name in pair]
        there = [np.isfinite(points[:, 0]) for points in seen]

        def residuals(pose, wanted=seen, there=there):
            both = cv2.composeRT(pose[:3], pose[3:], cv2.Rodrigues(R)[0], T)
            left = cv2.projectPoints(grid, pose[:3], pose[3:], rig["K"][0], np.array(rig["D"][0]))[0]
            right = cv2.projectPoints(grid, both[0], both[1], rig["K"][1], np.array(rig["D"][1]))[0]
            off = (left[:, 0] - wanted[0])[there[0]], (right[:, 0] - wanted[1])[there[1]]
            return np.concatenate(off).ravel()

        found, turn, shift = cv2.solvePnP(grid[there[0]], seen[0][there[0]], rig["K"][0],
                                          np.array(rig["D"][0]))
        if not found:
            raise methods.Failure("a held out board has no place")
        best = least_squares(residuals, np.concatenate((turn.ravel(), shift.ravel())), x_scale="jac")
        errors.append(np.sum(best.fun.reshape(-1, 2) ** 2, axis=1))
    return errors


class Bench:
    def __init__(self, options, work):
        pairs = list(enumerate(of_one_size(find_pairs(options.directory)), 1))
        if len(pairs) < 4:
            sys.exit(f"calibration_bench: {options.directory}: {len(pairs)} pairs of images found, "
                     "by left and right in their names; at least 4 are needed")
        self.rounds = 1 if options.quick else options.rounds
        self.all = make_stage(os.path.join(work, "all"), pairs)
        self.halves = [make_stage(os.path.join(work, f"half{i}"), pairs[i::2]) for i in range(2)]
        self.names = methods.image_pairs(self.all)
        columns, rows = (int(word) for word in options.board.split("x"))
        self.context = {"board": (columns, rows), "square_mm": options.square, "cache": {},
                        "vergence": options.vergence,
                        "stereo_calib": methods.compile_sample(options.samples, options.cache)}
        self.chosen = {name: method for name, method in methods.METHODS.items()
                       if options.only in name or name == methods.REFERENCE}
        self.grid = methods.points_of(self.context)
        # The common corners by which all methods are judged: OpenCV's.
        self.common = methods.their_corners(self.all, self.context)
        for half in self.halves:
            self.context["cache"]["opencv", half] = {
                name: self.common[name] for name in os.listdir(half) if name in self.common}
        self.context["focal_px"] = self.first_focal()

    def first_focal(self):
        """mrcal's initial values."""
        size = cv2.imread(os.path.join(self.all, self.names[0][0]), 0).shape[::-1]
        seen = [self.common[left].astype(np.float32) for left, _ in self.names
                if left in self.common]
        if not seen:
            return 1.2 * size[0]
        points = [self.grid.astype(np.float32)] * len(seen)
        return cv2.calibrateCamera(points, seen, size, None, None,
                                   flags=cv2.CALIB_FIX_K3)[1][0, 0]

    def measure(self):
        results = {name: {"seconds": [], "ratio": []} for name in self.chosen}
        order = list(self.chosen)
        for turn in range(self.rounds):
            took = {}
            for name in order[turn % len(order):] + order[:turn % len(order)]:
                if "error" in results[name]:
                    continue
                try:
                    found = self.chosen[name](self.all, self.context)
                except methods.Failure as failure:
                    results[name]["error"] = str(failure)
                    continue
                took[name] = found["seconds"]
                results[name]["seconds"].append(found["seconds"])
                results[name]["found"] = found
            for name in took.keys() if methods.REFERENCE in took else ():
                results[name]["ratio"].append(took[name] / took[methods.REFERENCE])
        return {name: self.judge(name, result) for name, result in results.items()}

    def judge(self, name, result):
        if "found" not in result:
            return {"error": result["error"]}
        found = result["found"]
        rig = found["rig"]
        line = {"views": found["views"], "pairs": len(self.names), "rms_px": found["rms_px"],
                "focal_px": float(rig["K"][0][0, 0]),
                "baseline_mm": float(np.linalg.norm(rig["T"])),
                "rows_own_px": rows_rms(rig, found["corners"], self.names)
                if found["corners"] else None,
                "rows_common_px": rows_rms(rig, self.common, self.names),
                "seconds": statistics.median(result["seconds"]),
                "ratio": statistics.median(result["ratio"]) if result["ratio"] else None}
        try:
            line.update(self.hold_out(name, found["corners"]))
        except methods.Failure as failure:
            line["held_out_error"] = str(failure)
        return line

    def hold_out(self, name, own):
        """Calibrates with every other pair and evaluates on the rest, both ways."""
        judged = {"common": [], "own": []}
        for half, other in zip(self.halves, reversed(self.halves)):
            rig = self.chosen[name](half, self.context)["rig"]
            rest = methods.image_pairs(other)
            judged["common"] += held_out_errors(rig, self.common, rest, self.grid)
            judged["own"] += held_out_errors(rig, own or {}, rest, self.grid)
        result = {}
        for which, errors in judged.items():
            if errors:
                result[f"held_out_{which}_px"] = float(np.sqrt(np.mean(np.concatenate(errors))))
        return result


def print_table(result):
    print(f"{result['directory']}: {result['pairs']} pairs, board {result['board']}, "
          f"squares of {result['square_mm']:g} mm, {result['rounds']} rounds")
    heads = ("views", "rms px", "f px", "baseline mm", "rows own", "common", "held out own",
             "common", "time s", "ratio")
    print(f"{'':24}" + "".join(f"{head:>13}" for head in heads))
    for name, line in result["methods"].items():
        if "error" in line:
            print(f"{name:24}  failed: {line['error']}")
            continue
        cells = [f"{line['views']}/{line['pairs']}"]
        for key, decimals in (("rms_px", 4), ("focal_px", 2), ("baseline_mm", 3), ("rows_own_px", 4),
                              ("rows_common_px", 4), ("held_out_own_px", 4), ("held_out_common_px", 4),
                              ("seconds", 2), ("ratio", 2)):
            value = line.get(key)
            cells.append("-" if value is None else f"{value:.{decimals}f}")
        print(f"{name:24}" + "".join(f"{cell:>13}" for cell in cells))
        if "held_out_error" in line:
            print(f"{'':24}  held out: {line['held_out_error']}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("directory")
    parser.add_argument("--board", required=True)
    parser.add_argument("--square", required=True, type=float)
    parser.add_argument("--vergence", required=True)
    parser.add_argument("--samples", default="/usr/share/doc/opencv-doc/examples/data")
    parser.add_argument("--cache", default=tempfile.gettempdir())
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default="")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if not re.fullmatch(r"\d+x\d+", options.board):
        parser.error("--board wants inner corners as COLUMNSxROWS, as in 9x6")
    with tempfile.TemporaryDirectory(prefix="vergence-bench-") as work:
        bench = Bench(options, work)
        result = {"directory": options.directory, "pairs": len(bench.names),
                  "board": options.board, "square_mm": options.square, "rounds": bench.rounds,
                  "opencv": cv2.__version__, "methods": bench.measure()}
    if options.json:
        print(json.dumps(result, indent=2))
    else:
        print_table(result)


if __name__ == "__main__":
    main()
