# SPDX-License-Identifier: Apache-2.0
"""Figure 3: pixels per mm² against zoom, frames a second against size, and a patch at 1x and at 10x."""
import json
import re

import cv2
import numpy as np

import board_shots
import surface_picture
from figure import Figure, Picture, Table, pyplot, svg_of
from rig import TOOLS

DISTANCE_MM = 2000
WANTED = (1.95, 6, 20, 60, 110, 175)  # px per mm²
# The paper's lens: 8.5 mm and pixels of 3.2 um, ten times.
NOMINAL_F_PX, NOMINAL_FACTOR = 8.5 / 3.2e-3, 10


def facing_board(folder):
    """A scene with the demo's board at the distance, across the line of sight."""
    text = (TOOLS / "simrig/scenes/charuco.yaml").read_text(encoding="utf-8")
    for pattern, value in ((r"origin_mm: \[125, 0, 1800\]", f"origin_mm: [125, 0, {DISTANCE_MM}]"),
                           (r"turn_deg: \[-12, 15, -5\]", "turn_deg: [0, 0, 2]")):
        text, count = re.subn(pattern, value, text)
        assert count == 1, pattern
    path = folder / "board.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def density_of(corners):
    """px per mm² of the squares whose four corners are there: median, and their number."""
    areas = []
    for number, at in corners.items():
        others = [corners.get(number + step) for step in (1, board_shots.COLUMNS + 1, board_shots.COLUMNS)]
        if number % board_shots.COLUMNS != board_shots.COLUMNS - 1 and None not in others:
            areas.append(cv2.contourArea(np.array([at, *others], np.float32)))
    return np.median(areas) / board_shots.SQUARE_MM ** 2 if areas else np.nan, len(areas)


def density(context):
    session = board_shots.take(context, facing_board(context.folder),
                               [f"zoom density={wanted} distance={DISTANCE_MM}" for wanted in WANTED], DISTANCE_MM)
    replies = json.loads((context.folder / "replies.json").read_text(encoding="utf-8"))
    rows, factors, measured = [], [], []
    for number, (wanted, reply) in enumerate(zip(WANTED, replies), 1):
        found = [density_of(corners) for corners in board_shots.detect(context, session, number)]
        least = min(found)  # what `density` is about: the camera that has fewer
        factors.append(reply["factor"])
        measured.append(least[0])
        nominal = (NOMINAL_F_PX * reply["factor"] / DISTANCE_MM) ** 2
        rows.append([f"{reply['factor']:.2f}x", f"{wanted:g}", f"{reply['density']:.2f}", f"{least[0]:.2f}",
                     f"{100 * (least[0] / reply['density'] - 1):+.2f} %", f"{least[1]}", f"{nominal:.2f}",
                     f"{reply['width']:.0f} mm"])
    svg = plot_density(np.array(factors), np.array(measured))
    return Figure("Figure 3: pixels per mm² against zoom",
                  f"The board {DISTANCE_MM / 1000:g} m away, across the line of sight: its squares are counted in each "
                  "picture. Wanted is what was asked for; stated is what the calibration makes of the positions read "
                  "after the move; f²/Z² are the lens's data: 8.5 mm times the zoom, pixels of 3.2 µm.",
                  f"vergence --connect zoom density={WANTED[-1]:g} distance={DISTANCE_MM}", context.seed,
                  [Table(["zoom", "wanted", "stated", "measured", "measured over stated", "squares", "f²/Z²",
                          "both see"], rows, "px/mm²")],
                  [Picture("pixels per mm² of the board", svg=svg)])


def plot_density(factors, measured):
    figure, axes = pyplot().subplots(figsize=(6.4, 4.2), layout="constrained")
    many = np.geomspace(1, NOMINAL_FACTOR, 100)
    axes.loglog(many, (NOMINAL_F_PX * many / DISTANCE_MM) ** 2, "--", color="#c33", label="f²/Z² of the data sheet")
    axes.loglog(factors, measured, "o", color="#0b6", label="measured from the board's squares")
    axes.set_xlabel("zoom")
    axes.set_ylabel("px per mm²")
    axes.set_xticks(range(1, 11), [f"{n}x" for n in range(1, 11)])
    axes.set_xticks([], minor=True)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return svg_of(figure)


# ---- frames a second

SIZES = (("2048 1536", 1), ("1024 768", 1), ("512 384", 1), ("256 192", 1), ("2048 1536", 4))  # window, skip
PAIRS = 4
TIMES = ("left_begin", "left_end", "right_begin", "right_end")


def frame_times(session):
    """Of each pair, in us: when its frames began and ended."""
    index = (session / "session.index").read_text(encoding="utf-8")
    return np.array([[int(re.search(rf" {name}_us=(\d+)", line)[1]) for name in TIMES]
                     for line in index.splitlines() if line.startswith("pair ")])


def take_sizes(context):
    """A session of PAIRS pairs for each of the SIZES; from the folder if they are there."""
    sessions = [context.folder / f"size_{number}" for number in range(len(SIZES))]
    if sessions[-1].exists():
        return sessions
    with board_shots.instrument(context, "still_life") as rig:
        for line in ("bringup", f"aim distance={SURFACE_MM}", f"zoom density=4 distance={SURFACE_MM}", "iris f/4",
                     "autoexpose iris=no"):
            rig.command(line)
        for session, (window, skip) in zip(sessions, SIZES):
            context.progress(f"still_life> window {window} skip={skip}")
            rig.command(f"window {window} skip={skip}")
            for number in range(PAIRS):
                rig.command(f"capture {session.name}{' add=yes' if number else ''}")
            board_shots.keep(rig, session)
    return sessions


def frames(context):
    rows, pixels, sensor, colour = [], [], [], []
    for session, (window, skip) in zip(take_sizes(context), SIZES):
        width, height = (int(word) // skip for word in window.split())
        times = frame_times(session)
        frame_ms = np.median(times[:, 1] - times[:, 0]) / 1e3
        pair_ms = np.median(np.diff(times[:, 0])) / 1e3
        develop_ms = board_shots.reconstructed(context, session, 1, "--near", "1300", "--far", "3000",
                                               "--threads", "1")["time_ms"]["develop"] / 2
        if skip == 1:
            pixels.append(width * height)
            sensor.append(1e3 / frame_ms)
            colour.append(1e3 / (frame_ms + develop_ms))
        rows.append([f"{width} x {height}{f', every {skip}th pixel' if skip > 1 else ''}", f"{frame_ms:.1f} ms",
                     f"{1e3 / frame_ms:.1f}", f"{1e3 / pair_ms:.2f}", f"{develop_ms:.1f} ms",
                     f"{1e3 / (frame_ms + develop_ms):.1f}"])
    figure, axes = pyplot().subplots(figsize=(6.4, 4.2), layout="constrained")
    axes.loglog(np.array(pixels) / 1e6, sensor, "o-", color="#0b6", label="raw, through the FPGA")
    axes.loglog(np.array(pixels) / 1e6, colour, "s--", color="#c33", label="colour interpolated, one after the other")
    axes.set_xlabel("megapixels")
    axes.set_ylabel("frames a second")
    axes.grid(alpha=0.3, which="both")
    axes.legend(frameon=False)
    return Figure("Figure 3: frames a second against the size of the frame",
                  "What the sensor sends through the FPGA's Verilog, from the times at which frames began and ended on "
                  f"the rig's clock; what a console gets by {PAIRS} captures one after the other, each a frame of both "
                  "cameras with lens positions before and after; and the same with the interpolation of colours, on one "
                  "processor of this PC.",
                  "vergence --connect capture NAME add=yes", context.seed,
                  [Table(["frame", "sent in", "frames a second, raw", "pairs a second", "colours add",
                          "frames a second, colour"], rows)],
                  [Picture("frames a second against the size", svg=svg_of(figure))])


# ---- the same patch at 1x and at 10x

SURFACE_MM = 1800
DENSITIES = (2.37, 237)  # px per mm²: ten times the focal length
PATCH_PX, BOX = np.array((400, 300)), 10  # columns and rows; of the box, a tenth
FLOWER_MM = 28  # to the right of the middle: white paint shows nothing at 10x
AROUND = 0.05  # of the depth, searched at 10x


def place_of(wide, tele, ratio):
    """The middle of the part of the wide picture that the middle of the tele one shows."""
    size = (int(tele.shape[1] / ratio), int(tele.shape[0] / ratio))
    small = cv2.resize(tele, size, interpolation=cv2.INTER_AREA)
    part = small[size[1] // 4:-(size[1] // 4), size[0] // 4:-(size[0] // 4)]
    score = cv2.matchTemplate(wide, part, cv2.TM_CCOEFF_NORMED)
    return np.array(cv2.minMaxLoc(score)[3]) + np.array(part.shape[1::-1]) / 2


def inside(values, middle, size):
    """Only the values of a rectangle around a pixel."""
    left, top = np.maximum(np.rint(middle - size / 2).astype(int), 0)
    part = np.full(values.shape, np.inf, np.float32)
    rows, columns = slice(top, top + int(size[1])), slice(left, left + int(size[0]))
    part[rows, columns] = values[rows, columns]
    return part, (rows, columns)


def patches(context):
    session = board_shots.take(context, "cylinder",
                               [f"zoom density={value} distance={SURFACE_MM}" for value in DENSITIES], SURFACE_MM,
                               FLOWER_MM)
    results, maps, plans, limits = [], [], [], (1500, 2600)
    for number in (1, 2):
        board_shots.reconstructed(context, session, number, "--with-pair", str(3 - number), "--near",
                                  f"{limits[0]:.0f}", "--far", f"{limits[1]:.0f}", "--threads", str(context.threads))
        results.append(context.folder / f"{session.name}_{number}")
        maps.append(cv2.imread(str(results[-1] / "disparity.pfm"), cv2.IMREAD_UNCHANGED))
        plans.append(surface_picture.plan_of(results[-1]))
        # At 10x no more is searched than around what 1x has in its middle.
        middle = inside(maps[-1], np.array(maps[-1].shape[::-1]) / 2, PATCH_PX)[0]
        depth = np.nanmedian(surface_picture.depths_mm(results[-1], middle))
        limits = ((1 - AROUND) * depth, (1 + AROUND) * depth)
    images = [cv2.imread(str(result / "left_rectified.png")) for result in results]
    ratio = plans[1]["f_px"] / plans[0]["f_px"]
    middle_tele = np.array(images[1].shape[1::-1]) / 2
    middle = place_of(images[0], images[1], ratio)
    parts = {"1x, the patch": (0, middle, PATCH_PX, PATCH_PX[0] / 2), "1x, the box": (0, middle, PATCH_PX / BOX, 0),
             "10x, the patch": (1, middle_tele, PATCH_PX, 0)}
    rows, views = [], []
    for name, (which, at, size, _) in parts.items():
        part, (down, across) = inside(maps[which], at, size)
        points, colours, spacing = surface_picture.points_of(results[which], part)
        reach = size[0] / plans[which]["f_px"] * SURFACE_MM
        rows.append([name, f"{int(size[0])} x {int(size[1])} px", f"{reach:.0f} mm", f"{len(points)}",
                     f"{100 * len(points) / size.prod():.0f} %",
                     f"{len(points) / (reach * reach * size[1] / size[0]):.2f}"])
        image = images[which].copy()
        if name == "1x, the patch":
            low = np.rint(middle - PATCH_PX / BOX / 2).astype(int)
            cv2.rectangle(image, low - 1, low + (PATCH_PX // BOX), (0, 200, 255), 1)
        enlarged = cv2.resize(image[down, across], (800, 600), interpolation=cv2.INTER_NEAREST)
        views.append(Picture(f"{name}, as captured", surface_picture.jpeg(enlarged)))
        if len(points):
            shown = surface_picture.view(points, colours, spacing, np.median(points, 0), 0.7 * reach,
                                         *surface_picture.VIEWS[0][1:])
            views.append(Picture(f"{name}: the surface {surface_picture.VIEWS[0][0]}", surface_picture.jpeg(shown)))
    return Figure("Figure 3: a patch of 300 x 400 px at 1x and at 10x",
                  f"The cylinder, {SURFACE_MM} mm away. The box in the first picture has 30 x 40 px; at ten times the "
                  "focal length the same part of the surface fills 300 x 400 px.",
                  f"vergence --connect zoom density={DENSITIES[1]} distance={SURFACE_MM}", context.seed,
                  [Table(["", "pixels", "wide", "points", "measured", "points per mm²"], rows, "The surfaces")], views)


FIGURES = {"density": density, "frames": frames, "patches": patches}
