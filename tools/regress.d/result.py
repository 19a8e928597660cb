# SPDX-License-Identifier: Apache-2.0
"""The compared parts of a result, their storage, and the differences of two results."""
import io
import json

import cv2
import numpy as np

STEPS_PER_PX = 256          # disparities are integers in this unit
NONE = np.int32(-2**31)
GRID_PX = 16                # distance of the pixels whose points are compared
FIGURES = {                 # of result.json, with their paths
    "density_percent": ("density_percent",),
    "vertices": ("counts", "vertices"),
    "triangles": ("counts", "triangles"),
    "depth_median_mm": ("depth_mm", "median"),
    "sigma_median_mm": ("sigma_mm", "median"),
    "rows_median_px": ("vertical_disparity", "median_px"),
}
TOLERANCES = {
    "disparity_px": "a disparity is off if it differs by more",
    "disparity_off_percent": "share of disparities that may be off, among pixels with one in both",
    "reasons_changed_percent": "share of all pixels that may have another reason",
    "points_mm": "a point is off if it moved farther",
    "points_off_percent": "share of the compared points that may be off",
    "figures_percent": "relative change of a figure that is allowed",
}


def read_image(path, form):
    """Its bytes and pixels. Not opened by OpenCV, which would print messages of its own."""
    data = path.read_bytes()
    image = cv2.imdecode(np.frombuffer(data, np.uint8), form) if data else None
    if image is None:
        raise ValueError(f"{path}: not an image")
    return data, image


def read_reasons(path):
    """Codes of the palette image; OpenCV returns only its colours."""
    data, image = read_image(path, cv2.IMREAD_COLOR)
    at = data.find(b"PLTE")
    if at < 4:
        raise ValueError(f"{path}: not an image with a palette")
    length = int.from_bytes(data[at - 4:at], "big")
    codes = np.full(image.shape[:2], 255, np.uint8)
    for code in range(length // 3):
        red, green, blue = data[at + 4 + 3 * code:at + 7 + 3 * code]
        codes[(image == (blue, green, red)).all(-1)] = code
    return codes


def read_points(path):
    data = path.read_bytes()
    head, mark, body = data.partition(b"DATA binary\n")
    if not mark or b"FIELDS x y z rgb sigma" not in head:
        raise ValueError(f"{path}: not a binary point cloud with the fields x y z rgb sigma")
    return np.frombuffer(body, "<f4").reshape(-1, 5)[:, :3]


class Result:
    """Disparities in steps (NONE: rejected), reasons, points on a grid (NaN: none), figures."""

    def __init__(self, steps, reasons, points, figures):
        self.steps, self.reasons, self.points, self.figures = steps, reasons, points, figures

    @classmethod
    def of_run(cls, folder):
        _, disparity = read_image(folder / "disparity.pfm", cv2.IMREAD_UNCHANGED)
        valid = np.isfinite(disparity)
        steps = np.where(valid, np.round(np.where(valid, disparity, 0) * STEPS_PER_PX), NONE)
        all_points = np.full((*disparity.shape, 3), np.nan, np.float32)
        all_points[valid] = read_points(folder / "points.pcd")
        reported = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        figures = {}
        for name, places in FIGURES.items():
            value = reported
            for place in places:
                value = value.get(place) if isinstance(value, dict) else None
            figures[name] = value
        return cls(steps.astype(np.int32), read_reasons(folder / "reasons.png"),
                   all_points[::GRID_PX, ::GRID_PX], figures)

    def packed(self):
        """The bytes of a reference file: differences along rows compress well."""
        flat = np.diff(self.steps.astype(np.int64), axis=1, prepend=0)
        file = io.BytesIO()
        np.savez_compressed(file, steps=flat.astype(np.int64), reasons=self.reasons,
                            points=self.points)
        return file.getvalue()

    @classmethod
    def of_packed(cls, data, figures):
        with np.load(io.BytesIO(data), allow_pickle=False) as kept:
            return cls(np.cumsum(kept["steps"], axis=1).astype(np.int32), kept["reasons"],
                       kept["points"], figures)


def percent(part, whole):
    return 100 * float(part) / max(int(whole), 1)


def differences(before, now, tolerance):
    """Each as (name, measured, limit), compared with `tolerance`."""
    if before.steps.shape != now.steps.shape:
        shapes = [f"{s.shape[1]} x {s.shape[0]}" for s in (before.steps, now.steps)]
        return [("size", f"{shapes[0]} -> {shapes[1]}", "the same")]
    both = (before.steps != NONE) & (now.steps != NONE)
    moved_px = np.abs(before.steps.astype(np.int64) - now.steps)[both] / STEPS_PER_PX
    with np.errstate(invalid="ignore"):
        moved_mm = np.linalg.norm(before.points.astype(float) - now.points, axis=-1)
    compared = np.isfinite(moved_mm)
    rows = [
        ("disparity_off_percent", percent((moved_px > tolerance["disparity_px"]).sum(), both.sum()),
         tolerance["disparity_off_percent"]),
        ("reasons_changed_percent",
         percent((before.reasons != now.reasons).sum(), before.reasons.size),
         tolerance["reasons_changed_percent"]),
        ("points_off_percent",
         percent((moved_mm[compared] > tolerance["points_mm"]).sum(), compared.sum()),
         tolerance["points_off_percent"])]
    for name, old in before.figures.items():
        new = now.figures.get(name)
        if old is None or new is None:
            change = 0.0 if old == new else 100.0
        else:
            change = 0.0 if old == new else 100 * abs(new - old) / max(abs(old), 1e-12)
        rows.append((f"{name} {number(old)} -> {number(new)}", change,
                     tolerance["figures_percent"]))
    return rows


def number(value):
    return "none" if value is None else f"{value:.6g}"


def too_much(row):
    _, measured, limit = row
    return isinstance(measured, str) or measured > limit


def coloured(steps, low, high):
    part = np.clip((steps - low) / max(high - low, 1), 0, 1)
    picture = cv2.applyColorMap((part * 255).astype(np.uint8), cv2.COLORMAP_TURBO)
    picture[steps == NONE] = 30
    return picture


def picture(before, now, tolerance):
    """Reference, now and difference side by side. In the difference, grey pixels are equal, red to
    white ones have a disparity that is off, green ones a new and magenta ones a missing
    disparity, blue ones another reason."""
    known = np.concatenate([r.steps[r.steps != NONE] for r in (before, now)])
    low, high = np.percentile(known, [1, 99]) if known.size else (0, 1)
    panels = [coloured(r.steps, low, high) for r in (before, now)]
    if before.steps.shape == now.steps.shape:
        had, has = before.steps != NONE, now.steps != NONE
        off = np.abs(before.steps.astype(np.int64) - now.steps) / STEPS_PER_PX
        off = np.where(had & has & (off > tolerance["disparity_px"]), off, 0)
        change = np.where(had[..., None], 110, 50).repeat(3, -1).astype(np.uint8)
        change[(before.reasons != now.reasons) & ~had & ~has] = (200, 60, 0)
        change[has & ~had] = (60, 200, 0)
        change[had & ~has] = (200, 0, 200)
        strength = np.clip(off * 200, 0, 255)[off > 0]
        change[off > 0] = np.stack([strength, strength, np.full_like(strength, 255)], -1)
        # A single pixel would be invisible in a small picture.
        spots = cv2.dilate((change != np.where(had[..., None], 110, 50)).any(-1).astype(np.uint8),
                           np.ones((5, 5), np.uint8)) > 0
        rim = spots & (change == np.where(had[..., None], 110, 50)).all(-1)
        change[rim] = (0, 160, 255)
        panels.append(change)
    height = max(panel.shape[0] for panel in panels)
    captions = ("reference", "now", "difference")
    framed = []
    for panel, caption in zip(panels, captions):
        panel = cv2.copyMakeBorder(panel, 26, 4 + height - panel.shape[0], 4, 4,
                                   cv2.BORDER_CONSTANT, value=(255, 255, 255))
        cv2.putText(panel, caption, (8, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 1,
                    cv2.LINE_AA)
        framed.append(panel)
    return cv2.hconcat(framed)
