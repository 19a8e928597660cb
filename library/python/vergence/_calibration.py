# SPDX-License-Identifier: Apache-2.0
"""Calibrations of a stereo pair: from files, from pictures of a board, from and to OpenCV's arrays."""
from __future__ import annotations

import json
import os
import tempfile
from typing import Any, Optional, Union

import numpy as np

from . import _vergence
from ._errors import ArgumentError, Error
from ._words import Bar, PathLike, Progress, operand_of, path_of, words_of


class Calibration:
    """Two cameras and their pose. Made by `load_calibration`, `calibrate`, `from_opencv` or
    `Calibration.parse`."""

    def __init__(self, handle: _vergence.Calibration) -> None:
        self._handle = handle

    @classmethod
    def parse(cls, text: str) -> "Calibration":
        """From our own text, as `text` returns it."""
        return cls(_vergence.parse(text))

    @property
    def text(self) -> str:
        """Our own text, with its checksum: the contents of a file rig.calibration."""
        return self._handle.text

    @property
    def format(self) -> str:
        """The format that it was read from: "vergence", "OpenCV", "ROS camera_info", ..."""
        return self._handle.format

    @property
    def notes(self) -> list[str]:
        """What was assumed, or left out of the pictures."""
        return self._handle.notes

    @property
    def good(self) -> bool:
        """False: of a `calibrate` whose verdict is that it should not be used."""
        return self._handle.good

    @property
    def verdict(self) -> str:
        """The last line of "vergence calibrate"; "" of a calibration from a file."""
        return self._handle.verdict

    @property
    def figures(self) -> dict[str, Any]:
        """calibration.json of `calibrate`: residuals, error bars, views; {} of one from a file."""
        return json.loads(self._handle.json) if self._handle.json else {}

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the left camera's images in px."""
        return self._handle.camera(0)["size"]

    @property
    def baseline_mm(self) -> float:
        """Distance between the cameras."""
        return float(np.linalg.norm(self._handle.pose()[1]))

    def to_opencv(self) -> dict[str, Any]:
        """OpenCV's arrays, in mm: M1, M2 (3, 3); D1, D2 (5,), (8,) if rational or (4,) of cv2.fisheye
        (`fisheye` is then True); R (3, 3), T (3,): point_right = R point_left + T; R1, R2 (3, 3), P1, P2
        (3, 4), Q (4, 4) of stereoRectify, for rectified images of the raw images' size; image_size
        (width, height)."""
        left, right = self._handle.camera(0), self._handle.camera(1)
        R, T = self._handle.pose()
        R1, R2, P1, P2 = self._handle.rectified()
        f, fy, baseline = P1[0, 0], P1[1, 1], -P2[0, 3] / P2[0, 0]
        stretch = f / fy
        Q = np.array([[1, 0, 0, -P1[0, 2]], [0, stretch, 0, -stretch * P1[1, 2]], [0, 0, 0, f],
                      [0, 0, 1 / baseline, -(P1[0, 2] - P2[0, 2]) / baseline]])
        return {"M1": left["M"], "D1": left["D"], "M2": right["M"], "D2": right["D"], "R": R, "T": T,
                "R1": R1, "R2": R2, "P1": P1, "P2": P2, "Q": Q, "image_size": left["size"],
                "fisheye": left["fisheye"]}

    def save(self, path: PathLike) -> None:
        """Writes our own text; an existing file is replaced once the new one is whole."""
        self._handle.save(path_of("path", path))

    def export(self, format: str, directory: PathLike) -> None:
        """Files of another program ("opencv", "ros", "kalibr", "mrcal") into a directory, which is created
        if missing."""
        self._handle.export(format, path_of("directory", directory))

    def __repr__(self) -> str:
        width, height = self.size
        return f"<Calibration {self.format}, {width} x {height} px, baseline {self.baseline_mm:.5g} mm>"


def load_calibration(path: PathLike, *, size: Optional[tuple[int, int]] = None, unit: Optional[str] = None,
                     rectified: bool = False, first_camera: Optional[int] = None,
                     at: Optional[str] = None) -> Calibration:
    """Any calibration that "vergence info" lists: our own text, OpenCV, numpy's .npz, ROS, Kalibr, EuRoC,
    mrcal, Middlebury, KITTI, DepthAI, RealSense. `path`: one of its files, its directory, or several
    joined by commas.

    size: (width, height) of the raw images, for formats that do not state it. unit: "mm", "cm" or "m", for
    formats that prescribe none. rectified: use the file's rectified cameras. first_camera: of several
    pairs (KITTI: 0 grey, 2 colour). at: of a calibration of all zooms, the state, as in
    "zoom=421,distance=1800"."""
    words = words_of({"size": "x"}, size=size, unit=unit, rectified=rectified, first_camera=first_camera, at=at)
    return Calibration(_vergence.load(path_of("path", path), words))


def calibrate(pictures: Union[PathLike, list[PathLike]], *, board: str, square_mm: float,
              charuco: Optional[str] = None, marker_mm: Optional[float] = None, model: Optional[str] = None,
              out: Optional[PathLike] = None, corners: Optional[PathLike] = None,
              threads: Optional[int] = None, progress: Progress = None) -> Calibration:
    """A stereo pair from pictures of a board, as "vergence calibrate".

    pictures: a folder, patterns, sessions, or a list of them. board: inner corners, "9x6". square_mm: side
    of a square; all lengths depend on it. charuco, marker_mm: dictionary and marker side of a coded board.
    model: "auto" (default), "none", "k1", "k1-k2", ..., "rational", "equidistant". out: a directory for
    rig.calibration, calibration.html, calibration.json and corners.vnl; None: nothing is written.

    The result may not be good: see its `good` and `verdict`."""
    operands = pictures if isinstance(pictures, (list, tuple)) else [pictures]
    words = words_of({}, board=board, square=square_mm, charuco=charuco, marker=marker_mm, model=model,
                     out=None if out is None else path_of("out", out),
                     corners=None if corners is None else path_of("corners", corners), threads=threads)
    with Bar(progress) as bar:
        return Calibration(_vergence.calibrate([operand_of("pictures", one) for one in operands] + words, bar.call))


def _matrix(name: str, value: Any, shapes: tuple[tuple[int, ...], ...]) -> np.ndarray:
    array = np.asarray(value, dtype=np.float64)
    if array.shape not in shapes and array.squeeze().shape not in shapes:
        wanted = " or ".join(str(shape) for shape in shapes)
        raise ArgumentError("ARGUMENT", f"{name} has the shape {array.shape} (expected {wanted})")
    if not np.isfinite(array).all():
        raise ArgumentError("ARGUMENT", f"{name} has values that are not finite")
    return array


def from_opencv(M1: Any, D1: Any, M2: Any, D2: Any, R: Any, T: Any, image_size: tuple[int, int], *,
                unit: Optional[str] = None, fisheye: bool = False) -> Calibration:
    """From the results of cv2.stereoCalibrate: camera matrices (3, 3), distortion coefficients, R (3, 3)
    and T (3,) with point_right = R point_left + T. `T` is in the unit of the board's squares: mm unless
    `unit` ("mm", "cm", "m") says otherwise. image_size: (width, height). fisheye: D1 and D2 (4,) are those
    of cv2.fisheye."""
    counts = ((4,),) if fisheye else ((0,), (4,), (5,), (8,), (12,), (14,))
    arrays = {"M1": _matrix("M1", M1, ((3, 3),)), "D1": _matrix("D1", D1, counts).reshape(1, -1),
              "M2": _matrix("M2", M2, ((3, 3),)), "D2": _matrix("D2", D2, counts).reshape(1, -1),
              "R": _matrix("R", R, ((3, 3),)), "T": _matrix("T", T, ((3,),)).reshape(3, 1)}
    if fisheye:
        arrays["fisheye_model"] = np.array([[1.0]])
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "arrays.npz")
        np.savez(path, **arrays)
        try:
            return load_calibration(path, size=(int(image_size[0]), int(image_size[1])), unit=unit)
        except Error as error:
            raise type(error)(error.code, str(error).replace(path, "the arrays")) from None
