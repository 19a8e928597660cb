# SPDX-License-Identifier: Apache-2.0
"""Pictures of a calibration board from an ideal pair of cameras, with exact truth."""
import math
import os

import cv2
import numpy

WIDTH, HEIGHT = 640, 480
FOCAL_PX, BASELINE_MM = 620.0, 90.0
COLUMNS, ROWS, SQUARE_MM = 9, 6, 25.0
MARGIN_MM, TEXELS_A_MM = 15, 4
ROOM_MM = 500  # distance of the boards
OPTIONS = ["--board", f"{COLUMNS}x{ROWS}", "--square", SQUARE_MM]

# Tilts about x and y, rotation about z in degrees; position of the middle in mm, relative to
# ROOM_MM in depth.
POSES = [(30, 0, 5, 0, 0, 0), (-30, 5, -4, 40, 10, 40), (0, 32, 2, -40, -20, 20),
         (5, -33, -6, 30, 20, 60), (25, 25, 8, -50, 30, 90), (-25, 22, 0, 50, -40, 10),
         (20, -28, -9, 60, 40, 70), (-20, -25, 3, -60, -40, 50), (10, 12, 15, 0, 30, -40),
         (-35, -8, -12, -20, 0, 100)]


def board_texture(columns=COLUMNS, rows=ROWS, square_mm=SQUARE_MM, margin_mm=MARGIN_MM):
    """Black at the top left, TEXELS_A_MM pixels per millimetre, white around it."""
    side = int(square_mm * TEXELS_A_MM)
    squares = (numpy.indices((rows + 1, columns + 1)).sum(axis=0) % 2 * 200 + 30).astype(numpy.uint8)
    board = numpy.kron(squares, numpy.ones((side, side), numpy.uint8))
    return numpy.pad(board, int(margin_mm * TEXELS_A_MM), constant_values=230)


def pose(tilt_x, tilt_y, turn, x, y, z):
    """Rotation and position of the board's middle in the left camera."""
    rotation = numpy.eye(3)
    for axis, degrees in ((2, turn), (1, tilt_y), (0, tilt_x)):
        vector = numpy.zeros(3)
        vector[axis] = math.radians(degrees)
        rotation = cv2.Rodrigues(vector)[0] @ rotation
    return rotation, numpy.array([x, y, ROOM_MM + z], float)


def picture(texture, where, right=False, scale=1, noise=1.0, seed=1):
    """One camera's grey picture; `scale` enlarges sensor and focal length alike."""
    rotation, middle = where
    middle = middle - numpy.array([BASELINE_MM if right else 0, 0, 0])
    width, height = WIDTH * scale, HEIGHT * scale
    camera = numpy.array([[FOCAL_PX * scale, 0, (width - 1) / 2],
                          [0, FOCAL_PX * scale, (height - 1) / 2], [0, 0, 1]])
    rows, columns = texture.shape
    # Texels to millimetres from the board's middle.
    to_mm = numpy.array([[1, 0, -(columns - 1) / 2], [0, 1, -(rows - 1) / 2],
                         [0, 0, TEXELS_A_MM]]) / TEXELS_A_MM
    board = numpy.column_stack([rotation[:, 0], rotation[:, 1], middle])
    fine = 3 if scale == 1 else 1
    enlarge = numpy.array([[fine, 0, (fine - 1) / 2], [0, fine, (fine - 1) / 2], [0, 0, 1]])
    image = cv2.warpPerspective(texture, enlarge @ camera @ board @ to_mm,
                                (width * fine, height * fine), flags=cv2.INTER_LINEAR,
                                borderMode=cv2.BORDER_CONSTANT, borderValue=120)
    if fine > 1:
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    image = cv2.GaussianBlur(image, (0, 0), 0.7 * scale)
    random = numpy.random.default_rng(seed)
    return numpy.clip(image + random.normal(0, noise, image.shape), 0, 255).astype(numpy.uint8)


def pairs(texture=None, poses=None, **options):
    """Left and right picture for each pose."""
    texture = board_texture() if texture is None else texture
    made = []
    for number, where in enumerate(POSES if poses is None else poses):
        made.append([picture(texture, pose(*where), right, seed=2 * number + right, **options)
                     for right in (False, True)])
    return made


def write(folder, made, left="left{:02d}.png", right="right{:02d}.png"):
    """Writes the pairs, numbered from 1."""
    for number, (a, b) in enumerate(made, 1):
        for name, image in ((left, a), (right, b)):
            path = os.path.join(folder, name.format(number))
            os.makedirs(os.path.dirname(path), exist_ok=True)
            if image is not None and not cv2.imwrite(path, image):
                raise OSError(path)
