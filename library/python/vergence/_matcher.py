# SPDX-License-Identifier: Apache-2.0
"""A matcher of rectified pairs with the interface of cv2.StereoSGBM."""
from __future__ import annotations

from typing import Any, Optional

import numpy as np

from ._surface import reconstruct


class StereoMatcher:
    """In place of cv2.StereoSGBM for rectified pairs: `compute` returns OpenCV's int16 disparities times
    16. What has no counterpart (blockSize, P1, P2, mode, ...) is not accepted.

    minDisparity, numDisparities: the disparities to search (any number). preset: "fast", "standard" or
    "best". speckleWindowSize: smallest region in px; None: 60. threads: None: all."""

    DISP_SHIFT = 4
    DISP_SCALE = 16

    def __init__(self, minDisparity: int = 0, numDisparities: int = 64, *, preset: str = "best",
                 speckleWindowSize: Optional[int] = None, threads: Optional[int] = None) -> None:
        self._minimum, self._count = int(minDisparity), int(numDisparities)
        self._preset, self._speckle_px, self._threads = preset, speckleWindowSize, threads

    @classmethod
    def create(cls, *words: Any, **named: Any) -> "StereoMatcher":
        """As cv2.StereoSGBM.create."""
        return cls(*words, **named)

    def getMinDisparity(self) -> int:
        return self._minimum

    def setMinDisparity(self, value: int) -> None:
        self._minimum = int(value)

    def getNumDisparities(self) -> int:
        return self._count

    def setNumDisparities(self, value: int) -> None:
        self._count = int(value)

    def getSpeckleWindowSize(self) -> int:
        return 60 if self._speckle_px is None else self._speckle_px

    def setSpeckleWindowSize(self, value: int) -> None:
        self._speckle_px = int(value)

    def compute(self, left: Any, right: Any) -> np.ndarray:
        """int16 (height, width): 16 (x_left - x_right); 16 (minDisparity - 1) where nothing was measured.
        left, right: uint8 or uint16 arrays of one size, grey or BGR, rows corresponding."""
        surface = reconstruct(left, right, rectified=True, disparity=(self._minimum, self._count),
                              preset=self._preset, speckle_px=self._speckle_px, threads=self._threads,
                              order="bgr", progress=False)
        disparity = surface.disparity
        rejected = self.DISP_SCALE * (self._minimum - 1)
        scaled = np.where(np.isfinite(disparity), np.rint(disparity * self.DISP_SCALE), rejected)
        return scaled.astype(np.int16)
