#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Draws disparity maps of Vergence's presets and of OpenCV's modes next to the ground truth.

usage: compare.py VERGENCE PAIR PICTURE [PRESET...]

VERGENCE is the program, PAIR a folder as tools/bench takes it (left.png, right.png, disparity.pfm,
meta.json), PICTURE the file to write. OpenCV's settings are those that tools/bench found best
(tests/bench/RESULTS.md). Prints each map's bad-1.0 and bad-2.0, filled by the rule of `vergence
evaluate`, of the pixels that both cameras see.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np

PANEL_WIDTH_PX = 480
CAPTION_PX = 30
UNKNOWN_GREY = 40


def read_pfm(path):
    with open(path, "rb") as file:
        file.readline()
        width, height = map(int, file.readline().split())
        scale = float(file.readline())
        values = np.frombuffer(file.read(), "<f4" if scale < 0 else ">f4")
    return values.reshape(height, width)[::-1].copy()


def seen_by_both(truth):
    """Pixels whose right pixel is not covered by a nearer one."""
    height, width = truth.shape
    seen = np.zeros(truth.shape, bool)
    for y in range(height):
        x = np.nonzero(np.isfinite(truth[y]))[0]
        right = np.rint(x - truth[y, x]).astype(int)
        inside = (right >= 0) & (right < width)
        x, right = x[inside], right[inside]
        nearest = np.full(width, -np.inf)
        np.maximum.at(nearest, right, truth[y, x])
        seen[y, x] = nearest[right] <= truth[y, x] + 1
    return seen


def filled(disparity):
    """Fills holes with the lower of the next values on both sides."""
    valid = np.isfinite(disparity)
    columns = np.arange(disparity.shape[1])
    rows = np.arange(disparity.shape[0])[:, None]
    before = np.maximum.accumulate(np.where(valid, columns, -1), 1)
    after = np.minimum.accumulate(np.where(valid, columns, columns.size)[:, ::-1], 1)[:, ::-1]
    left = np.where(before >= 0, disparity[rows, np.maximum(before, 0)], np.inf)
    right = np.where(after < columns.size,
                     disparity[rows, np.minimum(after, columns.size - 1)], np.inf)
    result = np.minimum(left, right)
    return np.where(np.isfinite(result), result, 0)


def by_vergence(program, pair, preset, begin, end):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, "reconstruct", pair / "left.png", pair / "right.png",
                        "--rectified", "--disparity", f"{begin}:{end}", "--preset", preset,
                        "--out", folder + "/out"], check=True, stdout=subprocess.DEVNULL)
        disparity = read_pfm(folder + "/out/disparity.pfm")
    disparity[~np.isfinite(disparity)] = np.nan
    return disparity


def by_opencv(pair, mode, uniqueness, begin, end):
    left, right = (cv2.imread(str(pair / f"{side}.png"), cv2.IMREAD_GRAYSCALE)
                   for side in ("left", "right"))
    count = (end - begin + 15) // 16 * 16
    # Padded, so that the left border is searched as well.
    border = begin + count
    left, right = (cv2.copyMakeBorder(image, 0, 0, border, 0, cv2.BORDER_REPLICATE)
                   for image in (left, right))
    matcher = cv2.StereoSGBM_create(begin, count, 3, 72, 288, 1, 31, uniqueness, 100, 1, mode)
    disparity = matcher.compute(left, right)[:, border:] / np.float32(16)
    disparity[disparity < begin] = np.nan
    return disparity


def errors(disparity, truth, seen):
    off = np.abs(filled(disparity) - truth)[seen]
    return 100 * (off > 1).mean(), 100 * (off > 2).mean()


def panel(disparity, caption, begin, end):
    level = np.nan_to_num((disparity - begin) / (end - begin), nan=0).clip(0, 1)
    picture = cv2.applyColorMap((255 * level).astype(np.uint8), cv2.COLORMAP_VIRIDIS)
    picture[~np.isfinite(disparity)] = UNKNOWN_GREY
    return captioned(picture, caption)


def captioned(picture, caption):
    height = round(picture.shape[0] * PANEL_WIDTH_PX / picture.shape[1])
    picture = cv2.resize(picture, (PANEL_WIDTH_PX, height), interpolation=cv2.INTER_AREA)
    strip = np.full((CAPTION_PX, PANEL_WIDTH_PX, 3), 255, np.uint8)
    cv2.putText(strip, caption, (4, CAPTION_PX - 10), cv2.FONT_HERSHEY_SIMPLEX, 0.52, (0, 0, 0), 1,
                cv2.LINE_AA)
    return np.vstack([picture, strip])


def main():
    if len(sys.argv) < 4 or sys.argv[1] in ("-h", "--help"):
        sys.exit(__doc__.strip())
    program, pair, target = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
    presets = sys.argv[4:] or ["best", "standard"]
    begin, end = json.loads((pair / "meta.json").read_text())["disparity_search"]
    truth = read_pfm(pair / "disparity.pfm")
    truth[~np.isfinite(truth)] = np.nan
    seen = seen_by_both(truth)
    panels = [captioned(cv2.imread(str(pair / "left.png")), "left image"),
              panel(truth, "ground truth", begin, end)]
    maps = [(f"Vergence {preset}", by_vergence(program, pair, preset, begin, end))
            for preset in presets]
    maps += [("OpenCV HH4", by_opencv(pair, cv2.STEREO_SGBM_MODE_HH4, 10, begin, end)),
             ("OpenCV 3-way", by_opencv(pair, cv2.STEREO_SGBM_MODE_SGBM_3WAY, 0, begin, end))]
    for name, disparity in maps:
        bad_1, bad_2 = errors(disparity, truth, seen)
        print(f"{name:20s} bad-1.0 {bad_1:5.2f} %  bad-2.0 {bad_2:5.2f} %")
        panels.append(panel(disparity, f"{name}: {bad_1:.1f} % off by > 1 px", begin, end))
    rows = [np.hstack(panels[i:i + 2]) for i in range(0, len(panels) // 2 * 2, 2)]
    if not cv2.imwrite(target, np.vstack(rows)):
        sys.exit(f"compare.py: cannot write {target}")


main()
