# SPDX-License-Identifier: Apache-2.0
"""Figures 4 and 5: a calibration pair before and after rectification; focal length against motor position."""
import json
import re

import cv2
import numpy as np

import board_shots
from figure import Figure, Picture, Table, pyplot, svg_of
from surface_picture import jpeg, smaller

WIDTH_MM, DISTANCE_MM = 450, 1800
LINES = 12  # drawn across the pair
SETTING_COUNTS, FOCUS_COUNTS = 5, 15  # readings of zoom and focus closer than this belong to one setting
BOARDS_MIN = 6
SIDES = ("left", "right")


# ---- Figure 4

def with_lines(images, rows):
    """Both pictures side by side, a line at the row of each point in the left one."""
    joined = np.hstack(images)
    for row in rows:
        cv2.line(joined, (0, int(row)), (joined.shape[1], int(row)), (0, 200, 255), max(1, joined.shape[0] // 500))
    return jpeg(smaller(joined, 1280), 88)


def row_differences(images):
    """Of the corners that OpenCV finds in both pictures: rows in the left one, right minus left."""
    found = [board_shots.opencv_corners(image) for image in images]
    both = sorted(set(found[0]) & set(found[1]))
    return (np.array([found[0][key][1] for key in both]),
            np.array([found[1][key][1] - found[0][key][1] for key in both]))


def pair(context):
    shot = board_shots.take(context, "charuco", [f"zoom fit={WIDTH_MM} distance={DISTANCE_MM}"], DISTANCE_MM)
    board_shots.reconstructed(context, shot, 1, "--near", "1500", "--far", "2500", "--threads", str(context.threads))
    result = context.folder / f"{shot.name}_1"
    raw = board_shots.pictures(shot, 1)
    rectified = [cv2.imread(str(result / f"{side}_rectified.png")) for side in SIDES]
    rows, pictures = [], []
    for name, images in (("as captured", raw), ("rectified", rectified)):
        at, difference = row_differences(images)
        rows.append([name, f"{len(difference)}", f"{np.sqrt(np.mean(difference ** 2)):.3f} px",
                     f"{np.abs(difference).max():.3f} px"])
        pictures.append(Picture(f"the pair {name}: lines through corners of the left picture",
                                with_lines(images, at[::max(1, len(at) // LINES)])))
    return Figure("Figure 4: a calibration pair before and after rectification",
                  f"The board, {DISTANCE_MM} mm away, {WIDTH_MM} mm wide in both pictures. The calibration of all "
                  "zooms gives the state's, which the pair's own matches adjust; the board's size is not used.",
                  "vergence reconstruct SESSION --calibration instrument.zoom", context.seed,
                  [Table(["", "corners", "rows apart, rms", "worst"], rows,
                         "Rows of the same corner, as OpenCV detects them")], pictures)


# ---- Figure 5

def readings(session):
    """Of each frame: side, zoom and focus as read."""
    frames = {}
    for line in (session / "session.index").read_text(encoding="utf-8").splitlines():
        for side in SIDES if line.startswith("pair ") else ():
            axes = re.search(rf" {side}_before=(\S+)", line)[1].split(",")
            zoom, focus = (int(axis.split(":")[0]) / 16 for axis in axes[1:3])
            name = re.search(rf" {side}_frame=(\w+)", line)[1]
            frames[f"frame-{name}.pnm"] = (side, zoom, focus)
    return frames


def settings(frames, side):
    """The frames of a side, by the settings of its zoom; of each those that share a focus."""
    groups = []
    for zoom, focus, name in sorted((zoom, focus, name) for name, (of, zoom, focus) in frames.items() if of == side):
        if not groups or zoom - groups[-1][-1][0] > SETTING_COUNTS:
            groups.append([])
        groups[-1].append((zoom, focus, name))
    return [same_focus(group) for group in groups]


def same_focus(group):
    """The most frames that share a focus; all if these are too few to calibrate with."""
    best = max(([shot for shot in group if abs(shot[1] - focus) < FOCUS_COUNTS] for _, focus, _ in group), key=len)
    return best if len(best) >= BOARDS_MIN else group


def alone(group, corners):
    """Zoom, focus, (fx, fy) and their standard deviations of one setting by OpenCV, as if it were the only one."""
    points, seen = [], []
    for _, _, name in group:
        numbers = [number for number, at in corners.get(name, {}).items()]
        if len(numbers) >= 12:
            points.append(np.array([[n % 10 * 24, n // 10 * 24, 0] for n in numbers], np.float32))
            seen.append(np.array([corners[name][n] for n in numbers], np.float32))
    _, K, _, _, _, sigma, _, _ = cv2.calibrateCameraExtended(
        points, seen, (2048, 1536), None, None, flags=cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST)
    zoom, focus = np.mean([shot[:2] for shot in group], 0)
    return zoom, focus, np.diag(K)[:2], sigma[:2, 0]


class Lens:
    """The focal lengths of one side of a calibration of all zooms, as zoom_calibration.h defines them."""

    def __init__(self, path, side):
        text = path.read_text(encoding="ascii")

        def numbers(name):
            return [float(word) for word in re.search(rf"^{side}_{name} (.*)$", text, re.M)[1].split()]
        self.zoom, self.focus = numbers("zoom_counts"), numbers("focus_counts")
        self.log_range, self.focal = numbers("log_focal_range"), numbers("focal")[1:]
        self.dioptre, self.by_count = numbers("focus_dioptre")[1:], numbers("focus_dioptre_by_count")
        self.pixel_mm = numbers("pixel_mm")[0]

    @staticmethod
    def unit(limits, value):
        return (2 * np.asarray(value) - limits[0] - limits[1]) / (limits[1] - limits[0])

    def image_distance(self, zoom, focus):
        """px: what a camera matrix holds at this zoom and focus."""
        series = np.polynomial.chebyshev.chebval
        f = series(self.unit(self.zoom, zoom), self.focal)
        dioptre = series(self.unit(self.log_range, np.log(f)), self.dioptre) + series(
            self.unit(self.focus, focus), [0, *self.by_count])
        return f / (1 - f * self.pixel_mm * dioptre / 1000)


def plot(axes, rest, name, points, curve, line):
    """One of the four plots, with what is left in percent below."""
    zoom, value, sigma = (np.array(column) for column in zip(*points))
    many = np.linspace(zoom[0], zoom[-1], 200)
    axes.errorbar(zoom, value, 2 * sigma, fmt="o", ms=3.5, capsize=2.5, color="#222", label="each zoom alone, ± 2 σ")
    axes.plot(many, np.interp(many, zoom, curve), color="#0b6", label="all zooms together")
    axes.plot(many, np.polyval(line, many), "--", color="#c33", label="the paper's line")
    axes.set_ylabel(f"{name} in px")
    axes.legend(fontsize=7, frameon=False)
    rest.errorbar(zoom, 100 * (value / curve - 1), 200 * sigma / value, fmt="o", ms=3, capsize=2, color="#222")
    rest.plot(zoom, 100 * (np.polyval(line, zoom) / curve - 1), "--", color="#c33")
    rest.axhline(0, color="#0b6")
    rest.set_ylim(-6, 6)
    rest.set_ylabel("from ours, %")
    rest.set_xlabel("zoom motor in counts")


def focal(context):
    session = board_shots.CAPTURE
    corners = board_shots.corners_of(context.calibration / "corners.vnl")
    frames = readings(session)
    figure, axes = pyplot().subplots(4, 2, figsize=(9.5, 9), height_ratios=[2.4, 1, 2.4, 1], layout="constrained")
    rows = []
    for column, side in enumerate(SIDES):
        context.progress(f"calibrating each zoom of the {side} camera alone")
        lens = Lens(context.calibration / "instrument.zoom", side)
        found = [alone(group, corners) for group in settings(frames, side)]
        curve = np.array([lens.image_distance(zoom, focus) for zoom, focus, _, _ in found])
        zoom = np.array([entry[0] for entry in found])
        for i, name in enumerate(("fx", "fy")):
            points = [(at, f[i], sigma[i]) for at, _, f, sigma in found]
            values = np.array([f for _, f, _ in points])
            line = np.polyfit(zoom, values, 1)
            plot(axes[2 * i][column], axes[2 * i + 1][column], f"{name}, {side}", points, curve, line)
            rows.append([f"{name}, {side}", f"{line[0]:.2f} px a count",
                         f"{100 * np.sqrt(np.mean((np.polyval(line, zoom) / curve - 1) ** 2)):.2f} %",
                         f"{100 * np.abs(np.polyval(line, zoom) / curve - 1).max():.2f} %",
                         f"{100 * np.sqrt(np.mean((values / curve - 1) ** 2)):.2f} %",
                         f"{np.sqrt(np.mean([((f - at) / s) ** 2 for (_, f, s), at in zip(points, curve)])):.1f}"])
    solved = json.loads((context.calibration / "calibration.json").read_text(encoding="utf-8"))
    return Figure("Figure 5: focal length against motor position",
                  f"{len(zoom)} zooms of the calibration's capture. The paper calibrates each zoom alone and draws a "
                  "straight line; here all are solved together, and zooms that were left out are predicted to "
                  f"{100 * solved['held_out_focal']:.3f} %. Focal lengths are at the focus of each setting.",
                  "vergence calibrate tests/data/zoom_capture --board 10x7 --square 24 --charuco 4x4_50 --marker 17",
                  context.seed,
                  [Table(["", "the paper's line", "it is off by, rms", "at worst", "zooms alone are off by, rms",
                          "over their sigma"], rows, "Against the calibration of all zooms")],
                  [Picture("fx and fy of both cameras; below each what is left", svg=svg_of(figure))])


FIGURES = {"calibration_pair": pair, "focal_length": focal}
