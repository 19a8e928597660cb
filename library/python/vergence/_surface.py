# SPDX-License-Identifier: Apache-2.0
"""Reconstruction, its result, and the comparison of a result with the truth."""
from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass
from typing import Any, NamedTuple, Optional, Union

import numpy as np

from . import _vergence
from ._calibration import Calibration
from ._errors import ArgumentError
from ._words import Bar, PathLike, Progress, path_of, words_of

#: Texts of the values of `Surface.reason`; 0 is "valid".
REASONS: tuple[str, ...] = _vergence.reasons

_LAYOUTS = {"grey": 1, "rgb": 2, "bgr": 3, "grbg": 4}
_DISPARITY, _DEPTH, _SIGMA, _REASON, _LEFT, _RIGHT = range(1, 7)
_SEPARATORS = {"disparity": ":", "raw": "x"}


class Measured(NamedTuple):
    """A value and its standard deviation. `sigma_common` is the part of `sigma` that all points share (the
    calibration's), so that averaging does not reduce it; None: not known, and not part of `sigma`."""

    value: float
    sigma: float
    sigma_common: Optional[float]

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        """Two significant digits of the deviation, and the value to the same place."""
        if not 0 < self.sigma < float("inf"):
            return f"{self.value:.7g} +- {self.sigma:.2g}"
        place = int(f"{self.sigma:.1e}".partition("e")[2]) - 1
        value, sigma = (round(number, -place) + 0.0 for number in (self.value, self.sigma))
        return f"{value:.{max(0, -place)}f} +- {sigma:.{max(0, -place)}f}"


def _measured(values: tuple[float, float, float]) -> Measured:
    return Measured(values[0], values[1], values[2] if values[2] >= 0 else None)


@dataclass(frozen=True)
class Plane:
    """A plane fitted to `used` of the `points` in the mask; the others lie far off it. `normal` points
    towards the camera; `distance_mm` is the left camera's from the plane, `tilt_deg` the angle between the
    normal and the camera's axis, `rms_mm` that of the points used."""

    normal: tuple[float, float, float]
    centre_mm: tuple[float, float, float]
    distance_mm: Measured
    tilt_deg: Measured
    normal_sigma_deg: float
    rms_mm: float
    points: int
    used: int


@dataclass(frozen=True)
class Cylinder:
    """A cylinder fitted to `used` of the `points` in the mask. `axis` has length 1; `centre_mm` lies on
    it, in the middle of the points used; `length_mm` is their extent along it."""

    axis: tuple[float, float, float]
    centre_mm: tuple[float, float, float]
    radius_mm: Measured
    axis_sigma_deg: float
    length_mm: float
    rms_mm: float
    points: int
    used: int


class Mesh(NamedTuple):
    """vertices_mm (n, 3) float32, triangles (m, 3) uint32, normals (n, 3) float32, colours (n, 3) uint8
    RGB."""

    vertices_mm: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    colours: np.ndarray


class Surface:
    """The result of `reconstruct`. Arrays are read-only views of its memory, without a copy, and keep it
    alive."""

    def __init__(self, handle: _vergence.Result) -> None:
        self._handle = handle
        self._arrays: Optional[dict[str, np.ndarray]] = None

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) of the maps."""
        width, height = self._handle.size
        return height, width

    @property
    def disparity(self) -> np.ndarray:
        """x_left - x_right in px of the rectified images: float32 (height, width), NaN: see `reason`."""
        return self._handle.map(_DISPARITY)

    @property
    def depth_mm(self) -> np.ndarray:
        """z in the left camera's frame: float32 (height, width). Raises if the result is not metric."""
        return self._handle.map(_DEPTH)

    @property
    def sigma_mm(self) -> np.ndarray:
        """Predicted deviation of each point along its ray, float32 (height, width), without
        `common_sigma_mm`. NaN too if refine=False."""
        return self._handle.map(_SIGMA)

    @property
    def reason(self) -> np.ndarray:
        """Why a pixel has no disparity: uint8 (height, width), numbers of `REASONS`; 0: valid."""
        return self._handle.map(_REASON)

    @property
    def left(self) -> np.ndarray:
        """The rectified left image: uint8 (height, width, 3) RGB."""
        return self._handle.map(_LEFT)

    @property
    def right(self) -> np.ndarray:
        """The rectified right image."""
        return self._handle.map(_RIGHT)

    def _surface(self, name: str) -> np.ndarray:
        if self._arrays is None:
            self._arrays = self._handle.surface()
        return self._arrays[name]

    @property
    def points_mm(self) -> np.ndarray:
        """The points, row by row of the map: float32 (n, 3), x y z in the left camera's frame."""
        return self._surface("points_mm")

    @property
    def colours(self) -> np.ndarray:
        """Colours of the points: uint8 (n, 3) RGB."""
        return self._surface("colours")

    @property
    def normals(self) -> np.ndarray:
        """Normals at the points: float32 (n, 3)."""
        return self._surface("normals")

    @property
    def pixels(self) -> np.ndarray:
        """Where the points are in the maps: uint32 (n,), y * width + x."""
        return self._surface("pixels")

    def mesh(self) -> Mesh:
        """The whole surface, as mesh.ply holds it; `write` simplifies."""
        return Mesh(self._surface("points_mm"), self._surface("triangles"), self._surface("normals"),
                    self._surface("colours"))

    @property
    def metric(self) -> bool:
        """False: focal length or baseline were assumed, and lengths mean nothing."""
        return self._handle.metric

    @property
    def common_sigma_mm(self) -> Optional[float]:
        """Standard deviation that all depths share, at the median depth; None: not known."""
        sigma = self._handle.common_sigma_mm
        return sigma if sigma >= 0 else None

    @property
    def notes(self) -> list[str]:
        """Assumptions and doubts, as "vergence reconstruct" prints them."""
        return self._handle.notes

    @property
    def figures(self) -> dict[str, Any]:
        """All figures: the contents of result.json."""
        return json.loads(self._handle.json)

    @property
    def calibration(self) -> Calibration:
        """The calibration in use, corrected by what the pair shows if it is of all zooms."""
        return Calibration(self._handle.calibration)

    def depth_at(self, x_px: float, y_px: float) -> Measured:
        """Depth (z) in mm at a pixel of the maps, rounded to a whole one."""
        return _measured(self._handle.depth(float(x_px), float(y_px)))

    def distance(self, a: tuple[float, float], b: tuple[float, float]) -> Measured:
        """Distance in mm between the points at two pixels (x, y) of the maps."""
        return _measured(self._handle.distance((float(a[0]), float(a[1])), (float(b[0]), float(b[1]))))

    def _mask(self, mask: Any) -> Optional[np.ndarray]:
        if mask is None:
            return None
        height, width = self.shape
        if isinstance(mask, tuple) and len(mask) == 4:
            x, y, w, h = (int(value) for value in mask)
            if w < 1 or h < 1 or x < 0 or y < 0 or x + w > width or y + h > height:
                raise ArgumentError("RANGE", f"region {x},{y},{w},{h} is outside of the maps, which have "
                                             f"{width} x {height} px")
            region = np.zeros((height, width), np.uint8)
            region[y:y + h, x:x + w] = 1
            return region
        array = np.asarray(mask)
        if array.shape != (height, width):
            raise ArgumentError("ARGUMENT", f"the mask has the shape {array.shape} (expected {height, width})")
        return np.ascontiguousarray(array != 0).view(np.uint8)

    def fit_plane(self, mask: Any = None) -> Plane:
        """The plane through the points where `mask` (height, width) is not 0, or in the region `mask` =
        (x, y, width, height) of the maps; None: all."""
        found = self._handle.plane(self._mask(mask))
        return Plane(**{**found, "distance_mm": _measured(found["distance_mm"]),
                        "tilt_deg": _measured(found["tilt_deg"])})

    def fit_cylinder(self, mask: Any = None) -> Cylinder:
        """The cylinder through these points, likewise."""
        found = self._handle.cylinder(self._mask(mask))
        return Cylinder(**{**found, "radius_mm": _measured(found["radius_mm"])})

    def write(self, out: PathLike, *, files: Union[None, str, list[str]] = None,
              triangles: Optional[int] = None, error_mm: Optional[float] = None, compress: bool = False,
              mesh_unit: Optional[str] = None, progress: Progress = None) -> None:
        """The files of "vergence reconstruct" into the directory `out`, all or none; the same bytes. files:
        only these, e.g. ["mesh.ply", "report.html"]. triangles, error_mm: a simpler mesh. compress:
        mesh.glb. mesh_unit: "mm", "cm" or "m", of mesh.ply and points.pcd."""
        words = words_of({}, files=files, triangles=triangles, error=error_mm, compress=compress,
                         mesh_unit=mesh_unit)
        with Bar(progress) as bar:
            self._handle.write(path_of("out", out), words, bar.call)

    def to_open3d(self) -> Any:
        """An open3d.geometry.TriangleMesh in mm; requires the package open3d."""
        import open3d

        mesh = self.mesh()
        made = open3d.geometry.TriangleMesh()
        made.vertices = open3d.utility.Vector3dVector(mesh.vertices_mm.astype(np.float64))
        made.triangles = open3d.utility.Vector3iVector(mesh.triangles.astype(np.int32))
        made.vertex_normals = open3d.utility.Vector3dVector(mesh.normals.astype(np.float64))
        made.vertex_colors = open3d.utility.Vector3dVector(mesh.colours.astype(np.float64) / 255)
        return made

    def __repr__(self) -> str:
        height, width = self.shape
        share = np.count_nonzero(self.reason == 0) / (height * width)
        return f"<Surface {width} x {height} px, {100 * share:.1f} % measured, {len(self.notes)} notes>"


def option_words(*, refine: bool = True, **options: Any) -> list[str]:
    """Options of `reconstruct` as those of the command line, which have no units in their names."""
    if options.get("debug") is not None:
        options["debug"] = path_of("debug", options["debug"])
    named = {re.sub("_(mm|px|size)$", "", name): value for name, value in options.items()}
    return words_of(_SEPARATORS, no_refine=not refine, **named)


def _is_path(image: Any) -> bool:
    return isinstance(image, (str, os.PathLike))


def _image(name: str, image: Any, order: str, bayer: Optional[str]) -> tuple[np.ndarray, int]:
    """A contiguous array and the number of its layout."""
    array = np.asarray(image)
    if array.dtype == np.bool_ or array.dtype.kind not in "ui" or array.dtype.itemsize > 2 or \
            array.dtype.kind == "i":
        hint = " (NaN cannot be matched: convert to uint8 or uint16)" if array.dtype.kind == "f" else ""
        raise ArgumentError("ARGUMENT", f"{name}: values are {array.dtype} (expected uint8 or uint16){hint}")
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[:, :, 0]
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] != 3) or 0 in array.shape:
        raise ArgumentError("ARGUMENT", f"{name}: the shape is {array.shape} (expected (height, width) or "
                                        "(height, width, 3))")
    if bayer not in (None, "none", "grbg"):
        raise ArgumentError("ARGUMENT", f"bayer is {bayer!r} (expected \"none\" or \"grbg\")")
    if order not in ("rgb", "bgr"):
        raise ArgumentError("ARGUMENT", f"order is {order!r} (expected \"rgb\" or \"bgr\")")
    layout = "grbg" if bayer == "grbg" else "grey"
    if array.ndim == 3:
        layout = order
    if not array.dtype.isnative:
        array = array.astype(array.dtype.newbyteorder("="))
    return np.ascontiguousarray(array), _LAYOUTS[layout]


def _pair(left: Any, right: Any, order: str, bayer: Optional[str]) -> tuple[np.ndarray, np.ndarray, int]:
    first, layout = _image("left", left, order, bayer)
    second, other = _image("right", right, order, bayer)
    if first.dtype != second.dtype or layout != other:
        raise ArgumentError("ARGUMENT", f"left is {first.dtype} {first.shape}, right {second.dtype} "
                                        f"{second.shape} (expected the same type and number of channels)")
    return first, second, layout


def reconstruct(left: Any, right: Any = None, calibration: Union[None, Calibration, PathLike] = None, *,
                near_mm: Optional[float] = None, far_mm: Optional[float] = None,
                disparity: Optional[tuple[int, int]] = None,
                region: Optional[tuple[int, int, int, int]] = None, scale: Optional[float] = None,
                preset: Optional[str] = None, refine: bool = True, keep_all: bool = False, fill: bool = False,
                speckle_px: Optional[int] = None, rectified: bool = False, focal_px: Optional[float] = None,
                baseline_mm: Optional[float] = None, unit: Optional[str] = None,
                first_camera: Optional[int] = None, order: str = "rgb", bayer: Optional[str] = None,
                bits: Optional[int] = None, raw_size: Optional[tuple[int, int]] = None,
                pair: Optional[int] = None, with_pair: Optional[int] = None, accept_mismatch: bool = False,
                threads: Optional[int] = None, debug: Optional[PathLike] = None,
                progress: Progress = None) -> Surface:
    """A surface from a pair of images, as "vergence reconstruct"; the same bytes.

    left, right: arrays or names of files. Arrays are uint8 or uint16, (height, width) grey or
    (height, width, 3) in the `order` "rgb" or "bgr" (OpenCV's); bayer="grbg": grey arrays are mosaics.
    Without `right`, `left` is the directory of a recorded session, of which `pair` is measured (default:
    the last). calibration: of the pair as it was taken, loaded or a file's name; may be missing if
    rectified=True, or if a session has its own.

    near_mm, far_mm: depths to search. disparity: (minimum, count) in px instead. region: (x, y, width,
    height) of the rectified left image. scale: size of the rectified images. preset: "fast", "standard"
    (default) or "best". refine: sub-pixel fit, with its deviation. keep_all: every match, however
    doubtful. fill: continue the surface into small holes, in meshes only. speckle_px: smallest region.
    focal_px, baseline_mm: of a rectified pair without a calibration. bits: significant ones of 16.
    debug: a directory for pictures of the matcher's stages. threads: default all; the result does not
    depend on it. The other options are those of the command line ("vergence help reconstruct").

    The GIL is released; Ctrl-C ends it within a second. Raises `NoSurfaceError`, `ArgumentError`, `Error`."""
    words = option_words(near_mm=near_mm, far_mm=far_mm, disparity=disparity, region=region, scale=scale,
                         preset=preset, refine=refine, keep_all=keep_all, fill=fill, speckle_px=speckle_px,
                         rectified=rectified, focal_px=focal_px, baseline_mm=baseline_mm, unit=unit,
                         first_camera=first_camera, raw_size=raw_size, pair=pair, with_pair=with_pair,
                         accept_mismatch=accept_mismatch, threads=threads, debug=debug)
    rig = None
    if isinstance(calibration, Calibration):
        rig = calibration._handle
    elif calibration is not None:
        words += ["--calibration", path_of("calibration", calibration)]
    with Bar(progress) as bar:
        if _is_path(left) and (right is None or _is_path(right)):
            words += words_of({}, bayer=bayer, bits=bits)
            return Surface(_vergence.reconstruct_files(
                os.fspath(left), None if right is None else os.fspath(right), rig, words, bar.call))
        if right is None or _is_path(left) or _is_path(right):
            raise ArgumentError("ARGUMENT", "left and right must be two arrays or two names of files")
        first, second, layout = _pair(left, right, order, bayer)
        return Surface(_vergence.reconstruct(first, second, ["left", "right"], layout, bits or 0, rig, words,
                                             bar.call))


def _map(name: str, value: Any) -> np.ndarray:
    array = np.asarray(value.disparity if isinstance(value, Surface) else value)
    if array.ndim != 2 or array.dtype.kind not in "fiu":
        raise ArgumentError("ARGUMENT", f"{name}: {array.dtype} {array.shape} (expected numbers of the shape "
                                        "(height, width))")
    return np.ascontiguousarray(array, dtype=np.float32)


def evaluate(surface: Union[Surface, np.ndarray], truth: Union[PathLike, Surface, np.ndarray], *,
             mask: Union[None, PathLike, np.ndarray] = None, scale: float = 0) -> dict[str, dict[str, float]]:
    """How far disparities are from the truth, by the rules of "vergence evaluate": for each of
    "filled_all", "measured_all" and, with a mask, "filled_visible" and "measured_visible", the number of
    pixels, the shares that are off by more than 0.5, 1, 2 and 4 px in percent, average and rms in px.

    surface: a result, or disparities in px, not finite where not measured. truth: the same, or a file (PFM
    or PNG; scale: values for one px in 8 bit PNG). mask: uint8, 255 visible in both, 128 occluded, 0
    unknown, or a file."""
    if not 0 <= scale < float("inf"):
        raise ArgumentError("RANGE", f"scale is {scale} (expected the values for one px, or 0 for the default)")
    disparity = _map("surface", surface)
    known: Any = mask
    if isinstance(truth, (str, os.PathLike)):
        path = os.fspath(mask) if isinstance(mask, (str, os.PathLike)) else None
        values, read = _vergence.load_truth(os.fspath(truth), path, float(scale))
        known = read if path is not None else mask
    else:
        if mask is not None and _is_path(mask):
            raise ArgumentError("ARGUMENT", "mask: a file requires a truth that is a file, too")
        values = _map("truth", truth)
    if values.shape != disparity.shape or (known is not None and np.shape(known) != disparity.shape):
        raise ArgumentError("ARGUMENT", f"the ground truth is {values.shape[1]}x{values.shape[0]}, the result "
                                        f"{disparity.shape[1]}x{disparity.shape[0]} (sizes must be equal, the "
                                        "mask's too)")
    if known is not None:
        if np.asarray(known).dtype != np.uint8:
            raise ArgumentError("ARGUMENT", f"mask: values are {np.asarray(known).dtype} (expected uint8: 255 "
                                            "visible in both, 128 occluded, 0 unknown)")
        known = np.ascontiguousarray(known)
    return _vergence.evaluate(disparity, np.ascontiguousarray(values), known)
