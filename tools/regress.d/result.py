# SPDX-License-Identifier: Apache-2.0
"""The compared parts of a result, the figures that stand for its map, and how two results differ."""
import json
import zlib

import cv2
import numpy as np

STEPS_PER_PX = 256          # disparities are integers in this unit
NONE = np.int32(-2**31)
PERCENTS = (5, 25, 50, 75, 95)
BLOCKS_ACROSS, BLOCKS_DOWN = 12, 8
MAP_FILES = ("disparity.pfm", "reasons.png")    # what the cache keeps of a result
FIGURES = {                 # of result.json, with their paths
    "density_percent": ("density_percent",),
    "vertices": ("counts", "vertices"),
    "triangles": ("counts", "triangles"),
    "depth_median_mm": ("depth_mm", "median"),
    "sigma_median_mm": ("sigma_mm", "median"),
    "rows_median_px": ("vertical_disparity", "median_px"),
}
TOLERANCES = {
    "disparity_px": "how far a quantile of the disparities, or a block's median, may move; with 0 the "
                    "map has to be\n" + 27 * " " + "the same, byte for byte",
    "points_mm": "how far a quantile of the points' x, y or z may move",
    "shares_percent": "change of the share of pixels with one reason, overall or kept in a block, in "
                      "percent of all",
    "blocks_off_percent": f"share of the {BLOCKS_ACROSS} x {BLOCKS_DOWN} blocks that may be off by more",
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


class Map:
    """Disparities in steps (NONE: rejected) and reasons, of a result or of a folder of the cache."""

    def __init__(self, folder):
        _, disparity = read_image(folder / MAP_FILES[0], cv2.IMREAD_UNCHANGED)
        self.valid = np.isfinite(disparity)
        self.steps = np.where(self.valid, np.round(np.where(self.valid, disparity, 0) * STEPS_PER_PX),
                              NONE).astype(np.int32)
        self.reasons = read_reasons(folder / MAP_FILES[1])

    def crc32(self):
        return f"{zlib.crc32(self.reasons.tobytes(), zlib.crc32(self.steps.astype('<i4').tobytes())):08x}"


def quantiles(values, digits):
    """Empty if there are no values."""
    return [round(float(value), digits) for value in np.percentile(values, PERCENTS)] if len(values) else []


def blocks_of(steps):
    """Of each block its share of kept pixels in percent and their median in px, as rows of text."""
    rows = []
    for band in np.array_split(steps, BLOCKS_DOWN, axis=0):
        words = []
        for block in np.array_split(band, BLOCKS_ACROSS, axis=1):
            kept = block[block != NONE]
            middle = f"{np.median(kept) / STEPS_PER_PX:.3f}" if kept.size else "-"
            words.append(f"{percent(kept.size, block.size):.1f}:{middle}")
        rows.append(" ".join(words))
    return rows


def reference_of(folder, found):
    """What reference.json keeps of the result in `folder`, whose map is `found`."""
    reported = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    figures = {}
    for name, places in FIGURES.items():
        value = reported
        for place in places:
            value = value.get(place) if isinstance(value, dict) else None
        figures[name] = value
    points = read_points(folder / "points.pcd")
    return {"size_px": [found.steps.shape[1], found.steps.shape[0]],
            "map_crc32": found.crc32(),
            "disparity_px": quantiles(found.steps[found.valid] / STEPS_PER_PX, 3),
            **{f"{axis}_mm": quantiles(points[:, column], 2) for column, axis in enumerate("xyz")},
            "reasons_percent": {name: round(percent(count, found.steps.size), 3)
                                for name, count in reported["reasons"].items()},
            "blocks": blocks_of(found.steps), "figures": figures}


def percent(part, whole):
    return 100 * float(part) / max(int(whole), 1)


def farthest(before, now):
    """The largest move of a quantile; all are lost or new where only one has any."""
    if len(before) != len(now):
        return "none" if before else "new"
    return max((abs(old - new) for old, new in zip(before, now)), default=0.0)


def blocks_off(before, now, tolerance):
    """The share of the blocks that differ by more than `tolerance`."""
    off = total = 0
    for old_row, new_row in zip(before, now):
        for old, new in zip(old_row.split(), new_row.split()):
            (old_share, old_px), (new_share, new_px) = old.split(":"), new.split(":")
            total += 1
            off += abs(float(old_share) - float(new_share)) > tolerance["shares_percent"] or (
                "-" not in (old_px, new_px) and
                abs(float(old_px) - float(new_px)) > tolerance["disparity_px"])
    return percent(off, total)


def differences(before, now, tolerance):
    """Of two references, each as (name, measured, limit, unit); a text that is measured is too much."""
    if before["size_px"] != now["size_px"]:
        shapes = ["{} x {}".format(*reference["size_px"]) for reference in (before, now)]
        return [("size", f"{shapes[0]} -> {shapes[1]}", "the same", "")]
    rows = [("disparity: quantiles", farthest(before["disparity_px"], now["disparity_px"]),
             tolerance["disparity_px"], "px")]
    if tolerance["disparity_px"] == 0 and before["map_crc32"] != now["map_crc32"]:
        rows.append(("map", "differs", "the same", ""))
    rows += [(f"{axis}: quantiles", farthest(before[f"{axis}_mm"], now[f"{axis}_mm"]),
              tolerance["points_mm"], "mm") for axis in "xyz"]
    shares = [reference["reasons_percent"] for reference in (before, now)]
    rows.append(("share of a reason", max(abs(shares[0].get(name, 0) - shares[1].get(name, 0))
                                          for name in {**shares[0], **shares[1]}),
                 tolerance["shares_percent"], "%"))
    rows.append(("blocks off", blocks_off(before["blocks"], now["blocks"], tolerance),
                 tolerance["blocks_off_percent"], "%"))
    for name, old in before["figures"].items():
        new = now["figures"].get(name)
        if old is None or new is None:
            change = 0.0 if old == new else 100.0
        else:
            change = 0.0 if old == new else 100 * abs(new - old) / max(abs(old), 1e-12)
        rows.append((f"{name} {number(old)} -> {number(new)}", change, tolerance["figures_percent"], "%"))
    return rows


def number(value):
    return "none" if value is None else f"{value:.6g}"


def too_much(row):
    _, measured, limit, _ = row
    return isinstance(measured, str) or measured > limit


def coloured(steps, low, high):
    part = np.clip((steps - low) / max(high - low, 1), 0, 1)
    picture = cv2.applyColorMap((part * 255).astype(np.uint8), cv2.COLORMAP_TURBO)
    picture[steps == NONE] = 30
    return picture


def picture(before, now, tolerance):
    """Reference, now and difference side by side, or only now where the cache has no map of the
    reference (`before` is None). In the difference, grey pixels are equal, red to
    white ones have a disparity that is off, green ones a new and magenta ones a missing
    disparity, blue ones another reason."""
    maps = [one for one in (before, now) if one is not None]
    known = np.concatenate([one.steps[one.valid] for one in maps])
    low, high = np.percentile(known, [1, 99]) if known.size else (0, 1)
    panels = [coloured(one.steps, low, high) for one in maps]
    if len(maps) == 2 and before.steps.shape == now.steps.shape:
        had, has = before.valid, now.valid
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
        lone = spots & (change == np.where(had[..., None], 110, 50)).all(-1)
        change[lone] = (0, 160, 255)
        panels.append(change)
    height = max(panel.shape[0] for panel in panels)
    captions = ("reference", "now", "difference") if len(maps) == 2 else ("now",)
    framed = []
    for panel, caption in zip(panels, captions):
        panel = cv2.copyMakeBorder(panel, 26, 4 + height - panel.shape[0], 4, 4,
                                   cv2.BORDER_CONSTANT, value=(255, 255, 255))
        cv2.putText(panel, caption, (8, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 1,
                    cv2.LINE_AA)
        framed.append(panel)
    return cv2.hconcat(framed)
