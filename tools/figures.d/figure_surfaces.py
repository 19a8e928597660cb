# SPDX-License-Identifier: Apache-2.0
"""Figures 6 to 9: four objects at several zooms, each by one `measure`, judged against the truth."""
import cv2
import numpy as np

import measured
import surface_picture
from figure import Figure, Picture, Table

# Figure of the paper, scene, widths in mm.
ROWS = ((6, "cylinder", (1000, 600, 360)), (7, "mug", (600, 250)), (8, "figurine", (500, 180)),
        (9, "level", (500, 150)))
# At full size the preset paper finds next to nothing in the noise of a pixel.
PAPER_SCALE = 0.5
METHODS = (("surface", "Vergence"), ("paper", "Preset paper at half size"), ("opencv", "OpenCV HH4"))
# Of the object in a view of the surface, and around its middle, which is looked for in this part of the map.
SHOWN, MIDDLE = 0.5, 0.3


def disparities(result):
    return cv2.imread(str(result / "disparity.pfm"), cv2.IMREAD_UNCHANGED)


def number(value, digits=2, unit=""):
    if value is None:
        return "-"
    return value if isinstance(value, str) else f"{value:.{digits}f}{unit}"


def fit_of(group, key):
    return (group.get("fit") or {}).get(key)


def accuracy(judged, scene):
    """A table with a column for each method."""
    table = {name: judged[key] for key, name in METHODS if key in judged}

    def row(name, value):
        return [name, *(value(found) for found in table.values())]

    def part(name, key):
        return lambda found: number(((found["parts"] or {}).get(name) or {}).get(key), 1, " %")
    rows = [
        row("visible measured", lambda f: number(f["visible"]["measured_percent"], 1, " %")),
        row("of it with texture", lambda f: number(f["visible_textured"]["measured_percent"], 1, " %")),
        row("error, median, absolute", lambda f: number(f["visible"].get("median_error_mm"), 2, " mm")),
        row("error, 95 %", lambda f: number(f["visible"].get("p95_error_mm"), 2, " mm")),
        row("bias", lambda f: number(f["visible"].get("bias_mm"), 2, " mm")),
        row("rms", lambda f: number(f["visible"].get("rms_mm"), 2, " mm")),
        row("after similarity: textured, median",
            lambda f: number(fit_of(f["visible_textured"], "median_error_px"), 3, " px")),
        row("all, median", lambda f: number(fit_of(f["visible"], "median_error_px"), 3, " px")),
        row("all, 95 %", lambda f: number(fit_of(f["visible"], "p95_error_px"), 2, " px")),
        row("scale", lambda f: number(f["similarity"]["scale"], 5)),
        row("wrong (> 3 px)", lambda f: number(fit_of(f["visible"], "wrong_3px_percent"), 2, " %")),
        row("wrong, of the whole picture's", lambda f: number(fit_of(f["picture"], "wrong_3px_percent"), 2, " %")),
    ]
    if scene == "level":
        rows += [row(f"{name} parts measured", part(name, "measured_percent")) for name in ("bright", "dark")]
        rows.append(row("wrong in dark parts", part("dark", "wrong_3px_percent")))
    return Table(["", *table], rows, "Against the truth")


def measurement(reply, found):
    """What was measured, and whether it was as good as it said."""
    common, sigma = found["common"] or {}, found["sigma"] or {}
    rows = [
        ["density", number(reply.get("density_px_per_mm2"), 1, " px/mm²")],
        ["distance", number(reply.get("distance_mm"), 0, " mm")],
        ["iris", f"f/{number(reply.get('f_number'), 1)}"],
        ["sharp depth", f"{number(reply.get('near_sharp_mm'), 0)} to {number(reply.get('far_sharp_mm'), 0)} mm"],
        ["rig time", number(reply.get("seconds"), 0, " s")],
        ["captures", str(reply.get("captures", "-"))],
        ["exposures", ", ".join(f"{exposure / 1000:.0f} ms" for exposure in reply.get("exposures", []))],
        ["sigma of a point: predicted", number(sigma.get("median_mm"), 2, " mm")],
        ["actual over predicted, rms", number(sigma.get("ratio_rms"), 2)],
        ["common sigma: predicted", number(common.get("sigma_mm"), 2, " mm")],
        ["actual common error", number(common.get("error_mm"), 2, " mm")],
        *[[f"holes: {reason}", number(share, 1, " %")] for reason, share in
          sorted((found["holes"] or {}).items(), key=lambda item: -item[1]) if share >= 0.05],
        *[["lost", text] for text in reply.get("losses", [])],
        ["in a sentence", reply.get("sentence", "-")],
    ]
    return Table(["", "measure"], rows, "The measurement")


def middle(result, values):
    """The nearest surface in the middle of the map, in the rectified left frame."""
    height, width = values.shape
    part = np.full(values.shape, np.inf, np.float32)
    rows = slice(int(height * (0.5 - MIDDLE / 2)), int(height * (0.5 + MIDDLE / 2)))
    columns = slice(int(width * (0.5 - MIDDLE / 2)), int(width * (0.5 + MIDDLE / 2)))
    part[rows, columns] = values[rows, columns]
    if not np.isfinite(part).any():
        part = values
    points = surface_picture.points_of(result, part)[0]
    return np.median(points, 0) if len(points) else np.array([0, 0, 1800.0])


def surface(figure_number, scene, width_mm):
    def make(context):
        words = context.measurement(f"--fit {width_mm}")
        reply = measured.measure(context, scene, words, context.folder)
        ours = context.folder / "m-surface"
        results = {"surface": ours,
                   "paper": measured.match_by_preset(context, context.folder, "paper", PAPER_SCALE),
                   "opencv": measured.match_by_opencv(context, ours, context.folder / "opencv")}
        results = {key: result for key, result in results.items() if result is not None}
        shown = [(key, name) for key, name in METHODS if key in results]
        missing = "".join(f". {name} finds no surface" for key, name in METHODS if key not in results)
        judged = {key: measured.judge(result, context.folder, scene, reply) for key, result in results.items()}
        maps = {key: disparities(result) for key, result in results.items()}
        limits = surface_picture.limits_of(ours, maps["surface"])
        pictures = [Picture("the rectified pair; a dotted line must meet the same points in both",
                            surface_picture.pair(ours))]
        pictures += [Picture(f"disparity: {name}; near is bright, grey was not measured",
                             surface_picture.disparity(results[key], maps[key], limits)) for key, name in shown]
        target = middle(ours, maps["surface"])
        for key, name in shown:
            for caption, data in surface_picture.views(results[key], maps[key], target, SHOWN * width_mm):
                pictures.append(Picture(f"surface {caption}: {name}", data))
        for index, picture in enumerate(pictures):
            (context.folder / f"picture_{index}.jpg").write_bytes(picture.data)
        return Figure(f"Figure {figure_number}: the {scene}, {width_mm} mm wide in the picture",
                      "1.8 m away, measured by one command from a cold instrument. OpenCV gets the pair at half size "
                      f"where it needs more than 1.5 GB. {reply.get('sentence', '')}{missing}.",
                      f"vergence --connect measure {scene} {words}", context.seed,
                      [accuracy(judged, scene), measurement(reply, judged["surface"])], pictures)
    return make


FIGURES = {f"{scene}_{width}": surface(number_, scene, width) for number_, scene, widths in ROWS
           for width in widths}
