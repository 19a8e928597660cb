#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Calibrates the stereo rig of opencv-doc's chessboard pairs as OpenCV's own example does.

usage: calibrate_chessboards.py PICTURES OUT
Writes OUT/intrinsics.yml and OUT/extrinsics.yml under the names that OpenCV's stereo_calib uses,
and OUT/boards.json: where the boards stood, in mm from the left camera.
"""
import json
import os
import sys

import cv2
import numpy as np

BOARD = (9, 6)       # inner corners
SQUARE_MM = 30.0     # T. Y. Bouguet's example, where the pictures come from
SUBPIX_WINDOW = (5, 5)
# Pair 10 is not in the package.
PAIRS = [i for i in range(1, 15) if i != 10]


def corners_of(path):
    image = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
    if image is None:
        sys.exit(f"calibrate_chessboards: cannot read {path}; is the package opencv-doc installed?")
    found, corners = cv2.findChessboardCorners(image, BOARD)
    if not found:
        return None, image.shape[::-1]
    end = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-4)
    return cv2.cornerSubPix(image, corners, SUBPIX_WINDOW, (-1, -1), end), image.shape[::-1]


def vertical_error_px(left, right, result, size):
    """Vertical disparity of all corners after an ideal rectification: what the calibration is worth."""
    _, m1, d1, m2, d2, rotation, translation = result[:7]
    r1, r2, p1, p2 = cv2.stereoRectify(m1, d1, m2, d2, size, rotation, translation)[:4]
    rows_left = cv2.undistortPoints(np.concatenate(left), m1, d1, R=r1, P=p1)[:, 0, 1]
    rows_right = cv2.undistortPoints(np.concatenate(right), m2, d2, R=r2, P=p2)[:, 0, 1]
    return float(np.median(np.abs(rows_left - rows_right)))


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: calibrate_chessboards.py PICTURES OUT")
    pictures, out = sys.argv[1:]
    board = np.zeros((BOARD[0] * BOARD[1], 3), np.float32)
    board[:, :2] = SQUARE_MM * np.mgrid[0:BOARD[0], 0:BOARD[1]].T.reshape(-1, 2)
    left, right, used = [], [], []
    for number in PAIRS:
        a, size = corners_of(os.path.join(pictures, f"left{number:02d}.jpg"))
        b, _ = corners_of(os.path.join(pictures, f"right{number:02d}.jpg"))
        if a is not None and b is not None:
            left.append(a)
            right.append(b)
            used.append(number)
    boards = [board] * len(used)
    _, m1, d1, _, _ = cv2.calibrateCamera(boards, left, size, None, None)
    _, m2, d2, _, _ = cv2.calibrateCamera(boards, right, size, None, None)
    end = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-8)
    result = cv2.stereoCalibrate(boards, left, right, m1, d1, m2, d2, size, criteria=end,
                                 flags=cv2.CALIB_USE_INTRINSIC_GUESS)
    rms, m1, d1, m2, d2, rotation, translation = result[:7]

    intrinsics = cv2.FileStorage(os.path.join(out, "intrinsics.yml"), cv2.FILE_STORAGE_WRITE)
    for name, matrix in (("M1", m1), ("D1", d1), ("M2", m2), ("D2", d2)):
        intrinsics.write(name, matrix)
    intrinsics.release()
    extrinsics = cv2.FileStorage(os.path.join(out, "extrinsics.yml"), cv2.FILE_STORAGE_WRITE)
    extrinsics.write("R", rotation)
    extrinsics.write("T", translation)
    extrinsics.release()

    depths = {}
    for number, corners in zip(used, left):
        _, turn, shift = cv2.solvePnP(board, corners, m1, d1)
        z = (cv2.Rodrigues(turn)[0] @ board.T.astype(float) + shift)[2]
        depths[f"{number:02d}"] = [float(z.min()), float(z.max())]
    with open(os.path.join(out, "boards.json"), "w", encoding="ascii") as file:
        json.dump({"pairs": used, "rms_px": float(rms),
                   "vertical_error_px": vertical_error_px(left, right, result, size),
                   "baseline_mm": float(np.linalg.norm(translation)),
                   "square_mm": SQUARE_MM, "corners": BOARD, "depth_mm": depths}, file, indent=1)


main()
