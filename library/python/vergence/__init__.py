# SPDX-License-Identifier: Apache-2.0
"""From two images and a calibration to a measured surface.

    import vergence as v
    rig = v.load_calibration("rig.calibration")
    s = v.reconstruct("left.png", "right.png", rig, near_mm=500, far_mm=4000)
    print(s.depth_at(640, 360), s.notes)
    s.write("result")

Lengths are in mm, angles in degrees where a name says `deg`. The frame is the left camera's: x right,
y down, z forward; pixel (0, 0) is the centre of the top-left pixel. Maps have the shape (height, width)
of the rectified left image, and are NaN where nothing was measured. Deviations (`sigma`) are one
standard deviation. What fails raises `Error` in the words of the program `vergence`.
"""
from ._batch import Row, batch
from ._calibration import Calibration, calibrate, from_opencv, load_calibration
from ._errors import ArgumentError, Error, NoSurfaceError
from ._instrument import Instrument, Pictures, connect
from ._matcher import StereoMatcher
from ._surface import REASONS, Cylinder, Measured, Mesh, Plane, Surface, evaluate, reconstruct
from ._vergence import build as __build__
from ._vergence import version as __version__

__all__ = [
    "ArgumentError", "Calibration", "Cylinder", "Error", "Instrument", "Measured", "Mesh", "NoSurfaceError",
    "Pictures", "Plane", "REASONS", "Row", "StereoMatcher", "Surface", "__build__", "__version__", "batch", "calibrate",
    "connect", "evaluate", "from_opencv", "load_calibration", "reconstruct",
]
