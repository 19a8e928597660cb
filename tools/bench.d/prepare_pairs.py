# SPDX-License-Identifier: Apache-2.0
"""Makes the pairs of benchmark and demo from packages, as folders with left.png, right.png,
disparity.pfm and meta.json. Skips folders that exist.

usage: prepare_pairs.py OUT [--aloe OPENCV_SAMPLES] --motorcycle WHEEL
"""
import argparse
import json
import os
import tempfile
import zipfile

import cv2
import numpy


def write_pfm(path, values):
    with open(path, "wb") as file:
        height, width = values.shape
        file.write(f"Pf\n{width} {height}\n-1\n".encode())
        file.write(numpy.flipud(values).astype("<f4").tobytes())


def write_pair(out, left, right, truth, disparities, name_of_set):
    """Writes into a temporary folder first, so that an interrupted run leaves no incomplete pair."""
    os.makedirs(os.path.dirname(out), exist_ok=True)
    folder = tempfile.mkdtemp(dir=os.path.dirname(out))
    cv2.imwrite(os.path.join(folder, "left.png"), left)
    cv2.imwrite(os.path.join(folder, "right.png"), right)
    write_pfm(os.path.join(folder, "disparity.pfm"), truth)
    with open(os.path.join(folder, "meta.json"), "w", encoding="ascii") as file:
        json.dump({"disparity_search": [0, disparities], "set": name_of_set}, file)
    os.chmod(folder, 0o755)
    os.rename(folder, out)


def aloe(out, samples):
    """Full size; truth in whole pixels, 0 where unknown."""
    truth = cv2.imread(os.path.join(samples, "aloeGT.png"), cv2.IMREAD_GRAYSCALE).astype("f4")
    truth[truth == 0] = numpy.inf
    left, right = (cv2.imread(os.path.join(samples, f"aloe{side}.jpg")) for side in "LR")
    write_pair(out, left, right, truth, 224, "opencv")


def motorcycle(out, wheel):
    """Middlebury 2014, a quarter of its size, from scikit-image."""
    with zipfile.ZipFile(wheel) as archive:
        def image(side):
            content = archive.read(f"skimage/data/motorcycle_{side}.png")
            return cv2.imdecode(numpy.frombuffer(content, "u1"), cv2.IMREAD_COLOR)

        with archive.open("skimage/data/motorcycle_disp.npz") as file, numpy.load(file) as arrays:
            truth = arrays[arrays.files[0]].astype("f4")
        truth[~numpy.isfinite(truth) | (truth <= 0)] = numpy.inf
        write_pair(out, image("left"), image("right"), truth, 64, "mb2014")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out")
    parser.add_argument("--aloe")
    parser.add_argument("--motorcycle")
    options = parser.parse_args()
    for name, make in (("aloe", aloe), ("motorcycle", motorcycle)):
        folder, source = os.path.join(options.out, name), getattr(options, name)
        if source and not os.path.exists(os.path.join(folder, "meta.json")):
            make(folder, source)


if __name__ == "__main__":
    main()
