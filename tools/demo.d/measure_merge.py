#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures what merged exposures gain in the dark parts of a scene, on the simulated rig.

usage: measure_merge.py VERGENCE VERGENCED OUT [WINDOW]

Takes pairs of the laser level, which is black and yellow, at 3x and f/8: one exposure, an average of 8,
brackets of 3 and 4; reconstructs each with the world's true cameras and prints a Markdown table. Dark are
the parts of the level with less than 4 % of the range in the one exposure.

  texture/noise  rms of the dark parts' texture over that of their noise, in the green pixels, within 7 x 7
                 of these. Texture is the covariance of two pairs, whose noise is independent
  measured       share of the dark parts, and of the others, that have a disparity
  within 1 px    share that has one within 1 px of the true one
  error          median of the disparities' errors

OUT, a new folder, receives the sessions, the truth and the results. WINDOW is the side of the frames, 512 px; a minute or
more of one processor for each million pixels.
"""
import json
import pathlib
import sys

import cv2
import numpy as np

from measure_rig import AIM, TOOLS, Failed, run, start, stop

SETTINGS = ("zoom 422", "iris 500", "exposure 160000")
CAPTURES = {"one": (), "average_8": ("average=8",), "bracket_3": ("bracket=3",),
            "bracket_4": ("bracket=4",)}
REFERENCE = "average_8"
NAMES = {"one": "one exposure", "average_8": "`average=8`", "bracket_3": "`bracket=3`",
         "bracket_4": "`bracket=4`"}
NEAR_MM, FAR_MM = "1500", "2300"
DARK_PART, WINDOW = 0.04, (7, 7)
SENSOR_BLACK, SENSOR_FULL, SATURATED, MERGE_BLACK = 42, 1023, 1008, 256  # merge_exposures.h


def take_pairs(vergence, vergenced, out, side):
    """The sessions out/files/NAME and the truth in out/truth; the replies, by name."""
    rig, daemon = f"unix:{out}/rig.sock", f"unix:{out}/vergenced.sock"
    replies = {}
    started = [start([vergence, "simulate", "level", "--listen", rig, "--files", out, "--seed", "1"],
                     out / "rig.log", out / "rig.sock")]
    try:
        started.append(start([vergenced, f"backend=sim {rig}", f"socket={out}/vergenced.sock",
                              f"files={out}/files", "store=none", "log=none"], out / "vergenced.log",
                             out / "vergenced.sock"))
        for line in (*AIM, *SETTINGS, f"window {side} {side}"):
            run([vergence, "--connect", daemon, *line.split()])
        for name, words in CAPTURES.items():
            print(f"   level> capture {name} {' '.join(words)}", file=sys.stderr, flush=True)
            reply = run([vergence, "--connect", daemon, "--json", "capture", name, *words])
            replies[name] = json.loads(reply.splitlines()[-1])["result"]
        run([TOOLS / "simrig/control", rig, "truth left left", "truth right right"])
    finally:
        for program in reversed(started):
            stop(program)
    (out / "truth").mkdir()
    for path in (*out.glob("left*.*"), *out.glob("right*.*")):
        path.rename(out / "truth" / path.name)
    return replies


def green_of(out, name, pair):
    """Green of the left frame, as a part of the range of the one exposure."""
    index = (out / "files" / name / "session.index").read_text(encoding="utf-8")
    frame = index.split(" left_frame=")[1][:8]
    mosaic = cv2.imread(str(out / "files" / name / f"frame-{frame}.pnm"), cv2.IMREAD_UNCHANGED)
    green = mosaic[0::2, 0::2].astype(float)
    if "merged" not in pair["left"]:
        return (green - SENSOR_BLACK) / (SENSOR_FULL - SENSOR_BLACK)
    single_us = float(json.loads(run_info(out))[0]["pairs"][0]["left"]["exposure_us"])
    range_part = (SATURATED - SENSOR_BLACK) / (SENSOR_FULL - SENSOR_BLACK)
    return ((green - MERGE_BLACK) / (65535 - MERGE_BLACK) * range_part
            * single_us / pair["left"]["exposure"])


def run_info(out):
    return run([run_info.vergence, "info", out / "files" / "one", "--json"])


def textures(out, replies):
    """Texture over noise of the dark parts, by name."""
    greens = {name: green_of(out, name, replies[name]) for name in CAPTURES}
    objects = cv2.imread(str(out / "truth" / "left_object.pgm"), cv2.IMREAD_UNCHANGED)[0::2, 0::2]
    text = (out / "truth" / "left.yaml").read_text(encoding="utf-8")
    names = [word.strip(' "') for word in text.split("objects:")[1].split("[")[1].split("]")[0].split(",")]
    dark = (objects == names.index("level") + 1) & (cv2.blur(greens[REFERENCE], WINDOW) < DARK_PART)
    dark = cv2.erode(dark.astype(np.uint8), np.ones(WINDOW)) > 0
    high = {name: green - cv2.blur(green, WINDOW) for name, green in greens.items()}
    texture = np.mean((high[REFERENCE] * high["bracket_4"])[dark])
    return {name: np.sqrt(texture / (np.mean(high[name][dark] ** 2) - texture)) for name in CAPTURES}


def pfm(path):
    with open(path, "rb") as file:
        file.readline()
        width, height = map(int, file.readline().split())
        kind = "<f4" if float(file.readline()) < 0 else ">f4"
        return np.frombuffer(file.read(), kind).reshape(height, width)[::-1]


def measure(vergence, out):
    """Rows of figures of the surfaces: dark parts, then the others, by name."""
    run([vergence, "info", out / "truth", "--convert", out / "true.calibration"])
    for name in CAPTURES:
        run([vergence, "reconstruct", out / "files" / name, "--calibration",
             out / "true.calibration", "--near", NEAR_MM, "--far", FAR_MM, "--out", out / name, "--quiet"])
        run([TOOLS / "simrig/compare", out / name, out / "truth", "--object", "level", "--out",
             out / name / "accuracy"])
    grey = cv2.imread(str(out / REFERENCE / "left_rectified.png"), cv2.IMREAD_GRAYSCALE)
    light = ((cv2.blur(grey, WINDOW) / 255.0) ** 2 * 65535 - MERGE_BLACK) / (65535 - MERGE_BLACK)
    rows = {}
    for name in CAPTURES:
        found = pfm(out / name / "disparity.pfm")
        true = pfm(out / name / "accuracy" / "truth.pfm")
        seen = cv2.imread(str(out / name / "accuracy" / "mask.png"), cv2.IMREAD_GRAYSCALE) == 255
        rows[name] = []
        for part in (seen & (light < DARK_PART), seen & (light >= DARK_PART)):
            errors = np.abs(found[part & np.isfinite(found)] - true[part & np.isfinite(found)])
            rows[name].append((100 * len(errors) / part.sum(), 100 * (errors <= 1).sum() / part.sum(),
                               np.median(errors)))
    return rows


def main():
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__.strip())
    vergence, vergenced, out = [pathlib.Path(word).resolve() for word in sys.argv[1:4]]
    run_info.vergence = vergence
    try:
        out.mkdir(parents=True)
        replies = take_pairs(vergence, vergenced, out, sys.argv[4] if len(sys.argv) > 4 else 512)
        ratios, rows = textures(out, replies), measure(vergence, out)
    except (Failed, OSError) as error:
        sys.exit(f"measure_merge: {error}")
    print("| capture | exposures (ms) | rig time (s) | texture/noise | dark: measured, within 1 px, error"
          " | others |\n|---|---|---|---|---|---|")
    for name, label in NAMES.items():
        left = replies[name]["left"]
        parts = left.get("merged", [{"frames": 1, "exposure": left["exposure"]}])
        times = ", ".join(f"{part['frames']} x " * (part["frames"] > 1) +
                          f"{part['exposure'] / 1000:.0f}" for part in parts)
        figures = [f"{row[0]:.1f} %, {row[1]:.1f} %, {row[2]:.2f} px" for row in rows[name]]
        print(f"| {label} | {times} | {replies[name]['skew'] / 1e6:.1f} | {ratios[name]:.2f} |"
              f" {figures[0]} | {figures[1]} |")


if __name__ == "__main__":
    main()
