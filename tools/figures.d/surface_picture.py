# SPDX-License-Identifier: Apache-2.0
"""Pictures of a result of `vergence reconstruct`: the pair, the disparities, the surface from two sides."""
import json

import cv2
import numpy as np

# Width of a picture of the pair, of a map and of a view of the surface.
PAIR_PX, VIEW_PX = 640, (720, 560)
SUPERSAMPLED = 2
VIEWS = (("from the left", 32, -14), ("from the right and above", -34, -30))  # yaw, pitch in degrees


def jpeg(image, quality=85):
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def smaller(image, width=PAIR_PX):
    height = image.shape[0] * width // image.shape[1]
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)


def pair(result):
    """The rectified images, side by side, with a line each tenth of the height: rows must agree."""
    shown = [smaller(cv2.imread(str(result / f"{side}_rectified.png"))) for side in ("left", "right")]
    for image in shown:
        image[image.shape[0] // 10::image.shape[0] // 10, ::4] = (200, 200, 0)
    return jpeg(np.hstack([shown[0], np.full((shown[0].shape[0], 8, 3), 255, np.uint8), shown[1]]))


def plan_of(result):
    return json.loads((result / "result.json").read_text(encoding="utf-8"))["plan"]


def depths_mm(result, values):
    """Of disparities; not a number where there is none."""
    plan = plan_of(result)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.isfinite(values), plan["f_px"] * plan["baseline_mm"] /
                        (values - plan["cx_left_px"] + plan["cx_right_px"]), np.nan)


def disparity(result, values, limits_mm):
    """Near is bright; grey without a disparity. `limits_mm`: the depths of the ends of the scale."""
    near, far = limits_mm
    depth_mm = depths_mm(result, values)
    known = np.isfinite(depth_mm)
    level = np.clip((1 / np.where(known, depth_mm, far) - 1 / far) / (1 / near - 1 / far), 0, 1)
    colour = cv2.applyColorMap((level * 255).astype(np.uint8), cv2.COLORMAP_VIRIDIS)
    colour[~known] = (120, 120, 120)
    # Nearest: a mean of disparity and hole would be neither.
    return jpeg(cv2.resize(colour, (PAIR_PX, values.shape[0] * PAIR_PX // values.shape[1]),
                           interpolation=cv2.INTER_NEAREST), 90)


def limits_of(result, values):
    """Depths for the ends of a scale."""
    known = depths_mm(result, values)
    known = known[np.isfinite(known)]
    near, far = np.percentile(known, [1, 99]) if known.size else (1000.0, 3000.0)
    return near, max(far, near + 1)


def points_of(result, values):
    """Points in the rectified left frame, their colours, and how far apart they are."""
    plan, depth_mm = plan_of(result), depths_mm(result, values)
    colours = cv2.imread(str(result / "left_rectified.png"))
    row, column = np.nonzero(np.isfinite(depth_mm))
    z = depth_mm[row, column]
    points = np.stack([(column - plan["cx_left_px"]) / plan["f_px"] * z,
                       (row - plan["cy_px"]) / plan["fy_px"] * z, z], 1)
    return points, colours[row, column], z / plan["f_px"]


def view(points, colours, spacing_mm, target, radius_mm, yaw_deg, pitch_deg):
    """The points within radius_mm of the target, seen from there, each as large as its pixel: what a renderer
    with triangles would bridge stays open."""
    near = ((points - target) ** 2).sum(1) < radius_mm ** 2
    points, colours, spacing_mm = points[near] - target, colours[near], spacing_mm[near]
    yaw, pitch = np.radians(yaw_deg), np.radians(pitch_deg)
    about_y = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(pitch), -np.sin(pitch)], [0, np.sin(pitch), np.cos(pitch)]])
    points = points @ (about_x @ about_y).T
    width, height = (SUPERSAMPLED * side for side in VIEW_PX)
    distance = 4 * radius_mm
    scale = 0.5 * height / (radius_mm / distance) / (distance + points[:, 2])
    x, y = 0.5 * width + scale * points[:, 0], 0.5 * height + scale * points[:, 1]
    size = np.clip(np.ceil(1.25 * scale * spacing_mm), 1, 9).astype(int)
    # Painted from far to near.
    order = np.argsort(-points[:, 2], kind="stable")
    image = np.full((height, width, 3), 238, np.uint8)
    depth = np.full((height, width), np.inf, np.float32)
    for across in range(size.max(initial=1)):
        for down in range(size.max(initial=1)):
            wanted = order[(size[order] > across) & (size[order] > down)]
            column = np.rint(x[wanted] - 0.5 * size[wanted]).astype(int) + across
            row = np.rint(y[wanted] - 0.5 * size[wanted]).astype(int) + down
            inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
            at, chosen = row[inside] * width + column[inside], wanted[inside]
            layer = np.full(height * width, np.inf, np.float32)
            layer[at] = points[chosen, 2]  # the last, nearest one remains
            pixels = np.zeros((height * width, 3), np.uint8)
            pixels[at] = colours[chosen]
            nearer = (layer < depth.ravel()).reshape(height, width)
            image[nearer] = pixels.reshape(height, width, 3)[nearer]
            depth[nearer] = layer.reshape(height, width)[nearer]
    return cv2.resize(image, VIEW_PX, interpolation=cv2.INTER_AREA)


def views(result, values, target, radius_mm):
    """Both views as (caption, JPEG). `target` in the rectified left frame."""
    points, colours, spacing_mm = points_of(result, values)
    return [(caption, jpeg(view(points, colours, spacing_mm, target, radius_mm, yaw, pitch)))
            for caption, yaw, pitch in VIEWS]
