#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures the chessboard in a result and compares it with the board's known squares.

usage: measure_board.py RESULT CALIBRATION_JSON
Corners come from OpenCV, in the rectified left image; depths from disparity.pfm. Prints JSON: number
of measured corners, median square side and its scatter, distance of the corners from their plane,
and the number of corners off that plane.
"""
import json
import os
import sys

import cv2
import numpy as np

OFF_MM = 2.0  # a corner farther than this from the board's plane is a wrong match


def corner_points(result, board):
    """The board's corners in the rectified left frame, in mm; NaN where nothing was measured."""
    image = cv2.imread(os.path.join(result, "left_rectified.png"), cv2.IMREAD_GRAYSCALE)
    disparity = cv2.imread(os.path.join(result, "disparity.pfm"), cv2.IMREAD_UNCHANGED)
    with open(os.path.join(result, "result.json"), encoding="utf-8") as file:
        plan = json.load(file)["plan"]
    columns, rows = board["corners"]
    found, corners = cv2.findChessboardCorners(image, (columns, rows))
    if not found:
        sys.exit("measure_board: no chessboard in the rectified left image")
    end = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 100, 1e-4)
    corners = cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), end)[:, 0]
    points = np.full((rows * columns, 3), np.nan)
    for i, (x, y) in enumerate(corners):
        column, row = int(round(x)), int(round(y))
        window = disparity[row - 2:row + 3, column - 2:column + 3]
        if np.isfinite(window).sum() < 13:
            continue
        # The plane fitted to the window's disparities, evaluated at the corner.
        v, u = np.nonzero(np.isfinite(window))
        fit = np.linalg.lstsq(np.stack([u - 2 - (x - column), v - 2 - (y - row), np.ones(len(u))], 1),
                              window[v, u].astype(float), rcond=None)[0]
        z = plan["f_px"] * plan["baseline_mm"] / (fit[2] - plan["cx_left_px"] + plan["cx_right_px"])
        points[i] = [(x - plan["cx_left_px"]) / plan["f_px"] * z,
                     (y - plan["cy_px"]) / plan["fy_px"] * z, z]
    return points.reshape(rows, columns, 3)


def distances_from_plane(points):
    """From the plane fitted to the inliers of the best of many planes through three points (RANSAC)."""
    draw = np.random.default_rng(1)
    near = None
    for _ in range(500):
        a, b, c = points[draw.choice(len(points), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        size = np.linalg.norm(normal)
        if size < 1:
            continue
        inside = np.abs((points - a) @ normal / size) <= OFF_MM
        if near is None or inside.sum() > near.sum():
            near = inside
    middle = points[near].mean(axis=0)
    return (points - middle) @ np.linalg.svd(points[near] - middle)[2][2]


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: measure_board.py RESULT CALIBRATION_JSON")
    with open(sys.argv[2], encoding="utf-8") as file:
        board = json.load(file)["board"]
    points = corner_points(sys.argv[1], board)
    sides = np.concatenate([np.linalg.norm(np.diff(points, axis=axis), axis=2).ravel()
                            for axis in (0, 1)])
    sides = sides[np.isfinite(sides)]
    flat = points.reshape(-1, 3)
    flat = flat[np.isfinite(flat).all(axis=1)]
    if len(sides) < 10:
        sys.exit("measure_board: too few corners were measured")
    away = np.abs(distances_from_plane(flat))
    near = away[away <= OFF_MM]
    print(json.dumps({"corners": len(flat), "square_mm": float(np.median(sides)),
                      "square_scatter_mm": float(1.4826 * np.median(np.abs(sides - np.median(sides)))),
                      "true_square_mm": board["square_mm"],
                      "plane_rms_mm": float(np.sqrt(np.mean(near ** 2))),
                      "off_plane": int(len(away) - len(near)), "off_plane_mm": OFF_MM}))


main()
