# SPDX-License-Identifier: Apache-2.0
"""Calibrations by several programs of one stage: a folder of leftNNN and rightNNN images.

A method is called with (stage, context) and returns {"rig", "views", "rms_px", "seconds",
"corners"}; a rig is {"K": [2 matrices], "D": [2 lists k1 k2 p1 p2 k3], "R", "T" in mm}. What cannot
be calibrated raises `Failure` with the reason.
"""
import json
import os
import re
import subprocess
import tempfile
import time

import cv2
import numpy as np


class Failure(Exception):
    """Why a method has no result: one line."""


def run(words, cwd=None, good=(0,)):
    begin = time.monotonic()
    try:
        done = subprocess.run([str(word) for word in words], cwd=cwd, capture_output=True, text=True,
                              timeout=1800, check=False)
    except FileNotFoundError as error:
        raise Failure(f"{words[0]} is not here") from error
    except subprocess.TimeoutExpired as error:
        raise Failure("no end after 30 minutes") from error
    if done.returncode not in good:
        lines = (done.stderr or done.stdout).strip().splitlines()
        raise Failure(lines[-1] if lines else f"exit code {done.returncode}")
    return done.stdout + done.stderr, time.monotonic() - begin


def image_pairs(stage):
    names = sorted(os.listdir(stage))
    left = [name for name in names if name.startswith("left")]
    return [(name, "right" + name[4:]) for name in left]


def points_of(context):
    columns, rows = context["board"]
    grid = np.zeros((columns * rows, 3))
    grid[:, :2] = np.mgrid[:columns, :rows].T.reshape(-1, 2) * context["square_mm"]
    return grid


# Ours.

def read_vnl(path):
    """Corners by image name, in the file's order, missing ones as NaN; images without corners are
    omitted."""
    corners = {}
    with open(path, encoding="utf-8") as file:
        for line in file:
            words = line.split()
            if words and not words[0].startswith("#"):
                point = [float("nan") if word == "-" else float(word) for word in words[1:3]]
                corners.setdefault(words[0], []).append(point)
    return {name: np.array(points) for name, points in corners.items() if len(points) > 1}


def ours(stage, context):
    columns, rows = context["board"]
    with tempfile.TemporaryDirectory() as out:
        _, seconds = run([context["vergence"], "calibrate", stage, "--board", f"{columns}x{rows}",
                          "--square", context["square_mm"], "--out", out, "--quiet"], good=(0, 5))
        with open(os.path.join(out, "calibration.json"), encoding="utf-8") as file:
            reported = json.load(file)
        found = read_vnl(os.path.join(out, "corners.vnl"))
        text, _ = run([context["vergence"], "info", os.path.join(out, "rig.calibration"), "--json"])
    rig = json.loads(text)[0]
    cameras = [rig[side] for side in ("left", "right")]
    return {"rig": {"K": [np.array([[c["focal_px"][0], 0, c["centre_px"][0]],
                                    [0, c["focal_px"][1], c["centre_px"][1]], [0, 0, 1]])
                          for c in cameras],
                    "D": [c["distortion_k1_k2_p1_p2_k3"] for c in cameras],
                    "R": cv2.Rodrigues(np.array(rig["rotation_right_left_rad"]))[0],
                    "T": np.array(rig["translation_right_left_mm"])},
            "views": reported["fit"]["pairs_used"],
            "rms_px": rig["rms_px"], "seconds": seconds, "corners": found}


# OpenCV, in this process; only the calls are timed.

def find_corners(path, context, how):
    grey = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
    board = tuple(context["board"])
    if how == "SB":
        found, corners = cv2.findChessboardCornersSB(
            grey, board, flags=cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE |
            cv2.CALIB_CB_ACCURACY)
    else:
        found, corners = cv2.findChessboardCorners(
            grey, board, flags=cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE)
        if found:
            stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-4)
            corners = cv2.cornerSubPix(grey, corners, (how, how), (-1, -1), stop)
    return corners.reshape(-1, 2).astype(np.float64) if found else None, grey.shape[::-1]


def opencv_corners(stage, context, how):
    corners, size = {}, None
    for pair in image_pairs(stage):
        for name in pair:
            found, size = find_corners(os.path.join(stage, name), context, how)
            if found is not None:
                corners[name] = found
    return corners, size


def opencv(how):
    def method(stage, context):
        begin = time.monotonic()
        corners, size = opencv_corners(stage, context, how)
        pairs = [pair for pair in image_pairs(stage) if all(name in corners for name in pair)]
        if len(pairs) < 3:
            raise Failure(f"finds the board in {len(pairs)} pairs")
        points = [points_of(context).astype(np.float32)] * len(pairs)
        seen = [[corners[pair[i]].astype(np.float32) for pair in pairs] for i in range(2)]
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-9)
        K, D = [], []
        for i in range(2):
            _, matrix, coefficients, _, _ = cv2.calibrateCamera(
                points, seen[i], size, None, None, flags=cv2.CALIB_FIX_K3, criteria=stop)
            K.append(matrix)
            D.append(coefficients)
        rms_px, K[0], D[0], K[1], D[1], R, T, _, _ = cv2.stereoCalibrate(
            points, *seen, K[0], D[0], K[1], D[1], size,
            flags=cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3, criteria=stop)
        return {"rig": {"K": K, "D": [d.ravel()[:5].tolist() for d in D], "R": R, "T": T.ravel()},
                "views": len(pairs), "rms_px": rms_px, "seconds": time.monotonic() - begin,
                "corners": corners}
    return method


# The unmodified sample of OpenCV's documentation.

def compile_sample(samples, folder):
    """Path of the program, built in `folder` if missing; "" when it cannot be built."""
    source = os.path.join(samples, "..", "cpp", "stereo_calib.cpp")
    program = os.path.join(folder, "stereo_calib")
    if os.path.exists(program):
        return program
    try:
        os.makedirs(folder, exist_ok=True)
        run(["g++", "-O2", source, "-I/usr/include/opencv4", "-lopencv_calib3d",
             "-lopencv_highgui", "-lopencv_imgcodecs", "-lopencv_imgproc", "-lopencv_core", "-o",
             program])
    except Failure:
        return ""
    return program


def stock(stage, context):
    if not context["stereo_calib"]:
        raise Failure("the sample could not be compiled")
    columns, rows = context["board"]
    with tempfile.TemporaryDirectory() as work:
        listed = os.path.join(work, "list.xml")
        with open(listed, "w", encoding="utf-8") as file:
            names = "\n".join(f'"{os.path.join(stage, name)}"'
                              for pair in image_pairs(stage) for name in pair)
            file.write(f'<?xml version="1.0"?>\n<opencv_storage><imagelist>\n{names}\n'
                       "</imagelist></opencv_storage>\n")
        text, seconds = run([context["stereo_calib"], "-nr", f"-w={columns}", f"-h={rows}",
                             f"-s={context['square_mm']}", listed], cwd=work, good=(0, 1, 255))
        rms = re.search(r"RMS error=\s*([\d.e+-]+)", text)
        views = re.search(r"(\d+) pairs have been successfully detected", text)
        if not rms or not os.path.exists(os.path.join(work, "extrinsics.yml")):
            raise Failure((text.strip().splitlines() or ["no result"])[-1])
        read = {}
        for name, fields in (("intrinsics.yml", "M1 D1 M2 D2"), ("extrinsics.yml", "R T")):
            file = cv2.FileStorage(os.path.join(work, name), cv2.FILE_STORAGE_READ)
            read.update({field: file.getNode(field).mat() for field in fields.split()})
    D = [read[name].ravel() for name in ("D1", "D2")]
    if any(np.any(d[5:] != 0) for d in D):
        # Its rational model: points that it undistorts are what counts; see `undistort`.
        D = [d[:8] for d in D]
    else:
        D = [d[:5] for d in D]
    return {"rig": {"K": [read["M1"], read["M2"]], "D": [d.tolist() for d in D], "R": read["R"],
                    "T": read["T"].ravel()},
            "views": int(views[1]), "rms_px": float(rms[1]), "seconds": seconds, "corners": None}


# mrcal.

def write_vnl(path, names, corners):
    with open(path, "w", encoding="utf-8") as file:
        file.write("# filename x y level\n")
        for name in names:
            for x, y in corners.get(name, []):
                seen = np.isfinite(x)
                file.write(f"{name} {x:.6f} {y:.6f} 0\n" if seen else f"{name} - - -\n")
            if name not in corners:
                file.write(f"{name} - - -\n")


def mrcal(source, model="LENSMODEL_OPENCV4"):
    """`source` returns the corners of a stage; of mrcal only the solver is timed."""
    def method(stage, context):
        import mrcal as library
        corners = source(stage, context)
        columns, rows = context["board"]
        with tempfile.TemporaryDirectory() as out:
            cache = os.path.join(out, "corners.vnl")
            write_vnl(cache, sorted(os.listdir(stage)), corners)
            _, seconds = run(
                ["mrcal-calibrate-cameras", "--corners-cache", cache, "--lensmodel", model,
                 "--focal", f"{context['focal_px']:.0f}", "--object-spacing",
                 context["square_mm"] / 1000, "--object-width-n", columns, "--object-height-n",
                 rows, "--pairs", "--outdir", out, "left*", "right*"], cwd=stage)
            models = sorted(name for name in os.listdir(out) if name.endswith(".cameramodel"))
            left, right = (library.cameramodel(os.path.join(out, name)) for name in models[:2])
        # Per point, without rejected points; mrcal prints the rms of single components.
        off = library.residuals_chessboard(left.optimization_inputs())
        rms_px = float(np.sqrt(np.mean(np.sum(off ** 2, axis=1))))
        Rt = library.compose_Rt(right.extrinsics_Rt_fromref(), left.extrinsics_Rt_toref())
        K, D = [], []
        for camera in (left, right):
            values = camera.intrinsics()[1]
            K.append(np.array([[values[0], 0, values[2]], [0, values[1], values[3]], [0, 0, 1]]))
            D.append((list(values[4:]) + [0] * 5)[:5])
        views = sum(all(name in corners for name in pair) for pair in image_pairs(stage))
        return {"rig": {"K": K, "D": D, "R": Rt[:3], "T": Rt[3] * 1000}, "views": views,
                "rms_px": rms_px, "seconds": seconds, "corners": corners}
    return method


def our_corners(stage, context):
    key = ("ours", stage)
    if key not in context["cache"]:
        context["cache"][key] = ours(stage, context)["corners"]
    return context["cache"][key]


def their_corners(stage, context):
    key = ("opencv", stage)
    if key not in context["cache"]:
        context["cache"][key] = opencv_corners(stage, context, 5)[0]
    return context["cache"][key]


METHODS = {
    "vergence": ours,
    "stock stereo_calib": stock,
    "OpenCV, window 11": opencv(11),
    "OpenCV, window 5": opencv(5),
    "OpenCV, SB": opencv("SB"),
    "mrcal, our corners": mrcal(our_corners),
    "mrcal, OpenCV's corners": mrcal(their_corners),
}
REFERENCE = "stock stereo_calib"
