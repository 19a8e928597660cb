# SPDX-License-Identifier: Apache-2.0
"""A measurement on the simulated rig and its judgement against the truth.

Nothing here but `judge` and `Instrument.truth` knows the world.
"""
import json
import shutil
import tempfile
from pathlib import Path

import cv2
import numpy as np

from figure import write_whole
from rig import TOOLS, Failed, Instrument, run

BLOCK_PX = 3
# Of OpenCV's matching costs: above this memory the pair is given to it at half its size.
OPENCV_BYTES = 1.5e9


def calibrate(programs, folder):
    """The result directory of the calibration of the rig "default", from the recorded corners of a board."""
    capture = TOOLS.parent / "tests/data/zoom_capture"
    run([programs / "tools/vergence", "calibrate", capture, "--board", "10x7", "--square", "24", "--charuco",
         "4x4_50", "--marker", "17", "--corners", capture / "corners.vnl", "--out", folder])


def measure(context, scene, words, folder):
    """The reply to `measure m WORDS` of a cold rig before the scene, as a table. The folder gets the session
    m, the surface m-surface, and the truth of its pair; what was measured before is taken from there."""
    kept = folder / "measure.json"
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    for left in ("m", "m-surface", "truth"):
        shutil.rmtree(folder / left, ignore_errors=True)
    context.progress(f"{folder.name}: measure {words}")
    with tempfile.TemporaryDirectory(prefix="vergence-figures-") as work:
        with Instrument((context.program("vergence"), context.program("vergenced")), Path(work), scene,
                        context.seed, context.calibration / "instrument.zoom", context.threads) as instrument:
            reply = instrument.measure("m", words, folder)
            instrument.truth(folder / "m", reply["pair"], folder / "truth")
    write_whole(kept, json.dumps(reply, indent=2) + "\n")
    return reply


def match_by_preset(context, folder, preset, scale):
    """The result directory of the measured pair with another preset; None: no surface found."""
    out, nothing = folder / preset, folder / f"{preset}.nothing"
    if (out / "result.json").exists():
        return out
    if nothing.exists():
        return None
    context.progress(f"{folder.name}: preset {preset}")
    try:
        run([context.program("vergence"), "measure", folder / "m", "--preset", preset, "--scale", scale,
             "--threads", context.threads, "--out", out, "--quiet"])
    except Failed as error:
        if "no surface was found" not in str(error):
            raise
        write_whole(nothing, f"{error}\n")
        return None
    return out


def match_by_opencv(context, ours, out):
    """OpenCV's best mode (SGBM HH4, settings of tools/bench) on our rectified pair, with our range."""
    if (out / "result.json").exists():
        return out
    out.mkdir(exist_ok=True)
    context.progress(f"{out.parent.name}: OpenCV's SGBM HH4 on the same rectified pair")
    plan = json.loads((ours / "result.json").read_text(encoding="utf-8"))["plan"]
    pair = [cv2.imread(str(ours / f"{side}_rectified.png"), cv2.IMREAD_GRAYSCALE) for side in ("left", "right")]
    low, count = plan["disparity_min"], plan["disparity_count"]
    shrink = 1 if 2 * pair[0].size * count <= OPENCV_BYTES else 2
    small = [cv2.resize(image, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
             if shrink > 1 else image for image in pair]
    # A disparity of the small pair is (d + offset) / shrink: both images shrink about the same corner.
    low_small, count_small = low // shrink, (-(-count // shrink) + 15) // 16 * 16 + 16
    before, after = max(low_small + count_small, 0), max(-low_small, 0)
    wide = [cv2.copyMakeBorder(image, 0, 0, before, after, cv2.BORDER_REPLICATE) for image in small]
    matcher = cv2.StereoSGBM_create(low_small, count_small, BLOCK_PX, 8 * BLOCK_PX ** 2, 32 * BLOCK_PX ** 2, 1,
                                    31, 10, 100, 2, cv2.StereoSGBM_MODE_HH4)
    found = matcher.compute(*wide)[:, before:before + small[0].shape[1]].astype(np.float32) / 16
    found[found < low_small] = np.inf
    if shrink > 1:
        found = cv2.resize(found, pair[0].shape[::-1], interpolation=cv2.INTER_NEAREST) * shrink
    if not cv2.imwrite(str(out / "disparity.pfm"), found):
        raise Failed(f"{out}/disparity.pfm: cannot be written")
    shutil.copy(ours / "left_rectified.png", out)
    write_whole(out / "result.json", (ours / "result.json").read_text(encoding="utf-8"))
    return out


def judge(result, folder, scene, reply):
    """Against the truth; kept in the result's directory."""
    kept = result / "accuracy.json"
    if not kept.exists():
        sharp = f"{reply['near_sharp_mm']}:{reply['far_sharp_mm']}" if reply.get("near_sharp_mm") else "0:1e9"
        write_whole(kept, run([TOOLS / "simrig/compare", result, folder / "truth", "--object", scene, "--sharp", sharp,
                               "--json"]))
    return json.loads(kept.read_text(encoding="utf-8"))
