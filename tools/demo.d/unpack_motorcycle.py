#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Extracts the motorcycle pair and its true disparities from scikit-image's wheel.

usage: unpack_motorcycle.py WHEEL OUT
Writes OUT/motorcycle_left.png, motorcycle_right.png and motorcycle_truth.pfm (inf: unknown).
"""
import io
import os
import sys
import zipfile

import numpy as np


def write_whole(path, data):
    """Gives the file its name only when complete, in case of an interruption."""
    with open(path + ".new", "wb") as file:
        file.write(data)
    os.replace(path + ".new", path)


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: unpack_motorcycle.py WHEEL OUT")
    wheel, out = sys.argv[1:]
    with zipfile.ZipFile(wheel) as archive:
        for name in ("motorcycle_left.png", "motorcycle_right.png"):
            write_whole(os.path.join(out, name), archive.read("skimage/data/" + name))
        with np.load(io.BytesIO(archive.read("skimage/data/motorcycle_disp.npz"))) as arrays:
            disparity = arrays["arr_0"].astype("<f4")
    disparity[~np.isfinite(disparity)] = np.inf
    height, width = disparity.shape
    # Rows of a PFM start at the bottom.
    write_whole(os.path.join(out, "motorcycle_truth.pfm"),
                f"Pf\n{width} {height}\n-1.0\n".encode() + disparity[::-1].tobytes())


main()
