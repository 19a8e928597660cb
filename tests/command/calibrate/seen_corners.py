# SPDX-License-Identifier: Apache-2.0
"""Corners as ideal cameras see them, in a cache next to blank pictures: many pairs and unusual rigs
in little time."""
import os

import cv2
import numpy

import boards

NOISE_PX = 0.05


def board_mm(columns=boards.COLUMNS, rows=boards.ROWS, square_mm=boards.SQUARE_MM):
    """The inner corners, row by row, from the board's middle."""
    y, x = numpy.mgrid[0:rows, 0:columns].astype(float)
    x, y = x - (columns - 1) / 2, y - (rows - 1) / 2
    return numpy.stack([x, y, 0 * x], axis=-1).reshape(-1, 3) * square_mm


def poses(count, seed=1, facing=numpy.eye(3)):
    """Boards about boards.ROOM_MM away, tilted in all directions from the orientation of `facing`.
    """
    random = numpy.random.default_rng(seed)
    made = []
    for number in range(count):
        tilt, side = numpy.radians(random.uniform(15, 35)), random.uniform(0, 2 * numpy.pi)
        turn = cv2.Rodrigues(numpy.array([0, 0, random.normal(0, 0.15)]))[0]
        lean = cv2.Rodrigues(numpy.array([numpy.cos(side), numpy.sin(side), 0]) * tilt)[0]
        middle = [boards.BASELINE_MM / 2 + random.uniform(-30, 30), random.uniform(-40, 40),
                  boards.ROOM_MM + random.uniform(-20, 120)]
        made.append((lean @ facing @ turn, numpy.array(middle)))
    return made


def pixels(points_mm, R=numpy.eye(3), t_mm=(0, 0, 0)):
    """Where a camera sees points; R and t map from their frame into its own."""
    seen = points_mm @ numpy.asarray(R, float).T + t_mm
    middle = numpy.array([boards.WIDTH - 1, boards.HEIGHT - 1]) / 2
    return seen[:, :2] / seen[:, 2:] * boards.FOCAL_PX + middle


def pairs(count=10, R=numpy.eye(3), t_mm=(-boards.BASELINE_MM, 0, 0), facing=numpy.eye(3),
          moved=(0, 0), seed=2):
    """What both cameras see of boards, with noise. R and t map from left to right. `moved`: mm and
    degrees (one sigma, each axis) by which a board moves before the right picture."""
    random = numpy.random.default_rng(seed)
    made = []
    for turn, middle in poses(count, facing=facing):
        points_mm = board_mm() @ turn.T + middle
        more = cv2.Rodrigues(numpy.radians(random.normal(0, 1, 3) * moved[1]))[0]
        later_mm = board_mm() @ (more @ turn).T + middle + random.normal(0, 1, 3) * moved[0]
        made.append([view + random.normal(0, NOISE_PX, view.shape) for view in
                     (pixels(points_mm), pixels(later_mm, R, t_mm))])
    return made


def write(folder, made, sigma_px=NOISE_PX):
    """left01.png, right01.png, ... and their corners; returns the cache's name. None for a missing
    picture."""
    os.makedirs(folder, exist_ok=True)
    cache = os.path.join(folder, "seen.vnl")
    random = numpy.random.default_rng(3)
    with open(cache, "w", encoding="ascii") as file:
        file.write(f"## a corner of level 0 has a standard deviation of {sigma_px} px\n"
                   "# filename x y level\n")
        for number, pair in enumerate(made, 1):
            for side, view in zip(("left", "right"), pair):
                if view is None:
                    continue
                name = f"{side}{number:02d}.png"
                image = numpy.full((boards.HEIGHT, boards.WIDTH), 128, numpy.uint8)
                image[0, :64] = random.integers(0, 255, 64)  # no two pictures are equal
                cv2.imwrite(os.path.join(folder, name), image)
                file.writelines(f"{name} {x:.6f} {y:.6f} 0\n" for x, y in view)
    return cache
