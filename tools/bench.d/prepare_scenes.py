# SPDX-License-Identifier: Apache-2.0
"""Renders scenes of the simulated rig, with their truth, as pairs for the benchmark.

usage: prepare_scenes.py OUT --part develop|check --render SIMRIG-RENDER --vergence VERGENCE
                         [--only TEXT] [--skip N]

Writes OUT/PART/NAME: left.png, right.png, disparity.pfm, mask.png, regions.png and meta.json,
rectified at half the size of the sensor. Renders only what is missing or differs from this recipe.

The scenes are those of tools/simrig/scenes, a plane tilted in both directions, and the floor alone,
its planks along the rows and across; each at 1x, 3x and 10x, and once for each part. All differ in
seed, exposure and lights; those for checking are also turned.

  --only TEXT   views whose name contains TEXT
  --skip N      every Nth pixel of the sensor: a smoke test
"""
import argparse
import copy
import hashlib
import importlib.machinery
import importlib.util
import itertools
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import cv2
import numpy
import yaml

from prepare_pairs import write_pfm

SIMRIG = pathlib.Path(__file__).resolve().parents[1] / "simrig"
RIG = SIMRIG / "rigs/default.yaml"
sys.dont_write_bytecode = True
_loader = importlib.machinery.SourceFileLoader("compare", str(SIMRIG / "compare"))
compare = importlib.util.module_from_spec(importlib.util.spec_from_loader("compare", _loader))
_loader.exec_module(compare)

# Motor positions of zoom and iris, exposure relative to that of 1x, depths to search in mm. The iris is
# closed by a part: the open one's depth of field would be 6 mm at 10x.
ZOOMS = {"1x": (300, 850, 1, (1100, 2700)), "3x": (422, 500, 14, (1350, 2450)),
         "10x": (850, 500, 14, (1650, 1990))}
# Exposures at 1x in us, and luminance of the two lights relative to the scene's: cycles whose lengths
# have no common divisor with each other or the number of views.
EXPOSURES_US = (12000, 8000, 15000, 5000, 11000)
LIGHTS = ((1, 1), (0.3, 2.5), (1.2, 0), (0.7, 1), (1, 3), (0.5, 0.5), (0, 4))
TURN_FOR_CHECK_DEG = 20
SCALE = 0.5
MARGIN_PX = 4           # of the search, around the true disparities
REGION_TEXTURED = 128   # BENCH_REGION_TEXTURED


def load(name):
    return yaml.safe_load((SIMRIG / "scenes" / f"{name}.yaml").read_text(encoding="utf-8"))


def parts_of(scene):
    return [part for entry in scene["objects"] for part in entry.values()]


def object_of(scene, name):
    return next(part for part in parts_of(scene) if part["name"] == name)


def tilted():
    scene = load("plane")
    object_of(scene, "plane").update(turn_deg=[30, -40, 4], size_mm=[900, 700])
    return scene


def floor(turn_deg):
    scene = load("cylinder")
    scene["room"]["tilt_deg"] = 25
    scene["objects"] = [entry for entry in scene["objects"] if "solid" not in entry]
    object_of(scene, "table").update(turn_deg=[-90, turn_deg, 0], size_mm=[2600, 2600])
    return scene


SCENES = {"cylinder": lambda: load("cylinder"), "mug": lambda: load("mug"),
          "figurine": lambda: load("figurine"), "level": lambda: load("level"),
          "still_life": lambda: load("still_life"), "tilted": tilted,
          "floor_along": lambda: floor(0), "floor_across": lambda: floor(90)}


def varied(scene, number, is_check):
    scene = copy.deepcopy(scene)
    for light, factor in zip(scene["lights"], LIGHTS[number % len(LIGHTS)]):
        light["luminance"] = [factor * value for value in light["luminance"]]
    scene["lights"] = [light for light in scene["lights"] if any(light["luminance"])]
    if is_check:
        for entry in scene["objects"]:
            if "solid" in entry:
                entry["solid"]["turn_deg"][1] += TURN_FOR_CHECK_DEG
        for part in parts_of(scene):
            if part["name"] == "plane":
                part["turn_deg"] = [-25, 45, -8]
    return scene


class View:
    """One pair: a scene, a zoom, and what differs from the other views."""

    def __init__(self, number, name, zoom, is_check):
        self.name, self.zoom, self.part = f"{name}_{zoom}", zoom, "check" if is_check else "develop"
        self.number = number
        self.scene = varied(SCENES[name](), number, is_check)

    def options(self, side, skip):
        position, iris, times, _ = ZOOMS[self.zoom]
        exposure_us = times * EXPOSURES_US[self.number % len(EXPOSURES_US)]
        return [str(word) for word in (
            "--camera", side, "--zoom", position, "--iris", iris, "--exposure", exposure_us,
            "--seed", 2 * self.number + (side == "right"), "--skip", skip)]

    def recipe(self, skip):
        """Digest of all that the pair is made from, but for the renderer itself."""
        words = [self.scene, ZOOMS[self.zoom], SCALE, MARGIN_PX,
                 [self.options(side, skip) for side in ("left", "right")]]
        digest = hashlib.sha256(json.dumps(words, sort_keys=True).encode() + RIG.read_bytes())
        for image in sorted((SIMRIG / "scenes").glob("*.png")):
            digest.update(image.read_bytes())
        return digest.hexdigest()[:16]


def views():
    every = list(itertools.product(SCENES, ZOOMS))
    for number in range(2 * len(every)):
        turn, index = divmod(number, len(every))
        yield View(number, *every[index], (index + turn) % 2 == 1)


def run(*words):
    words = [str(word) for word in words]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"prepare_scenes.py: {' '.join(words)}: {done.stderr.strip()}")


def render(view, options, folder):
    for image in (SIMRIG / "scenes").glob("*.png"):
        os.symlink(image, folder / image.name)
    (folder / "scene.yaml").write_text(yaml.safe_dump(view.scene), encoding="utf-8")
    for side in ("left", "right"):
        run(options.render, folder / "scene.yaml", RIG, "--out", folder / side,
            *view.options(side, options.skip))


def regions_of(plan, left, pixels, result, known):
    """Number of the object at each pixel, and REGION_TEXTURED. `pixels`: where raw images show it."""
    regions = numpy.zeros(known.shape, numpy.uint8)
    for number, name in enumerate(left.objects, 1):
        regions[left.shows(name, pixels)] = number
    regions[compare.textured(result, plan.size, known) & (regions > 0)] |= REGION_TEXTURED
    return regions


def write_view(view, options, folder, out):
    near_mm, far_mm = ZOOMS[view.zoom][3]
    result = folder / "result"
    # Only its rectified images are used.
    run(options.vergence, "reconstruct", folder / "left.png", folder / "right.png", "--calibration",
        folder, "--near", near_mm, "--far", far_mm, "--scale", SCALE, "--preset", "fast",
        "--keep-all", "--out", result)
    plan = compare.Plan(result)
    left, right = compare.Camera(folder, "left"), compare.Camera(folder, "right")
    truth = compare.Truth(plan, left, right)
    known = (numpy.isfinite(truth.disparity) & (truth.depth_mm > near_mm) &
             (truth.depth_mm < far_mm))
    searched = truth.disparity[known & truth.seen]
    search = [int(searched.min()) - MARGIN_PX, int(searched.max()) + MARGIN_PX + 1]
    out.mkdir()
    mask = numpy.where(known, numpy.where(truth.seen, 255, 128), 0).astype(numpy.uint8)
    cv2.imwrite(str(out / "mask.png"), mask)
    cv2.imwrite(str(out / "regions.png"), regions_of(plan, left, truth.left_pixels, result, known))
    write_pfm(out / "disparity.pfm", numpy.where(known, truth.disparity, numpy.inf))
    for side in ("left", "right"):
        os.replace(result / f"{side}_rectified.png", out / f"{side}.png")
    meta = {"disparity_search": search, "part": view.part, "regions": left.objects,
            "recipe": view.recipe(options.skip)}
    (out / "meta.json").write_text(json.dumps(meta), encoding="ascii")


def is_made(out, recipe):
    try:
        return json.loads((out / "meta.json").read_text(encoding="ascii"))["recipe"] == recipe
    except (OSError, ValueError, KeyError):
        return False


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--part", choices=("develop", "check"), required=True)
    parser.add_argument("--render", required=True)
    parser.add_argument("--vergence", required=True)
    parser.add_argument("--only", default="")
    parser.add_argument("--skip", type=int, default=1)
    options = parser.parse_args()
    part = options.out / options.part
    part.mkdir(parents=True, exist_ok=True)
    wanted = [view for view in views() if view.part == options.part and options.only in view.name and
              not is_made(part / view.name, view.recipe(options.skip))]
    for done, view in enumerate(wanted):
        print(f"rendering {view.part}/{view.name}, {done + 1} of {len(wanted)}", file=sys.stderr)
        # A folder of its own first, so that an interrupted run leaves no incomplete pair.
        with tempfile.TemporaryDirectory(dir=options.out) as holder:
            folder = pathlib.Path(holder)
            render(view, options, folder)
            write_view(view, options, folder, folder / "pair")
            if (part / view.name / "meta.json").exists():  # of another recipe
                shutil.rmtree(part / view.name)
            os.rename(folder / "pair", part / view.name)


if __name__ == "__main__":
    main()
