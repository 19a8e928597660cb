# SPDX-License-Identifier: Apache-2.0
"""A measurement on the simulated rig and its judgement against the truth.

Nothing here but `judge` and `Instrument.truth` knows the world.
"""
import json
import re
import shutil
import tempfile
from pathlib import Path

import cv2
import numpy as np

from rig import TOOLS, Failed, Instrument, run

BLOCK_PX = 3
# Of OpenCV's matching costs: above this memory the pair is given to it at half its size.
OPENCV_BYTES = 1.5e9


def begins_us(session, number):
    """When both frames of a pair began."""
    index = (session / "session.index").read_text(encoding="utf-8")
    pair = re.search(rf"^pair number={number} .*", index, re.M)
    if pair is None:
        raise Failed(f"{session}: has no pair {number}")
    return [re.search(rf" {side}_begin_us=(\d+)", pair[0])[1] for side in ("left", "right")]


def measure(context, scene, words, folder):
    """The reply to `measure NAME WORDS` of a cold rig before the scene, as a table; the session and the truth
    of its pair are in the folder. Taken from there when it was measured before."""
    kept = folder / "measure.json"
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    for left in ("session", "truth"):
        shutil.rmtree(folder / left, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix="vergence-figures-") as work:
        with Instrument((context.program("vergence"), context.program("vergenced")), Path(work), scene,
                        context.seed, context.calibration / "instrument.zoom", context.threads) as instrument:
            context.progress(f"{scene}> measure {folder.name} {words}")
            reply = instrument.figures(f"measure m {words}")
            instrument.truth(folder / "truth", begins_us(instrument.files / "m", reply["pair"]))
            shutil.move(instrument.files / "m", folder / "session")
    kept.write_text(json.dumps(reply, indent=2) + "\n", encoding="utf-8")
    return reply


def reconstruct(context, reply, folder, preset=None, scale=1):
    """The result directory of the pair as `measure` reconstructs it, or otherwise; None: no surface found."""
    out = folder / (preset or "surface")
    if (out / "result.json").exists():
        return out
    words = ["--pair", reply["pair"]]
    if reply["with_pair"]:
        words += ["--with-pair", reply["with_pair"]]
    if preset:
        words += ["--preset", preset, "--scale", scale]
    context.progress(f"reconstructing{f' with the preset {preset}' if preset else ''}")
    nothing = folder / f"{out.name}.nothing"
    if nothing.exists():
        return None
    command = [context.program("vergence"), "reconstruct", folder / "session", "--calibration",
         context.calibration / "instrument.zoom", "--near", reply["near_mm"], "--far", reply["far_mm"], *words,
         "--threads", context.threads, "--out", out, "--quiet"]
    try:
        run(command)
    except Failed as error:
        if "no surface was found" not in str(error):
            raise
        nothing.write_text(f"{error}\n", encoding="utf-8")
        return None
    return out


def match_by_opencv(context, ours, out):
    """OpenCV's best mode (SGBM HH4, settings of tools/bench) on our rectified pair, with our range."""
    if (out / "result.json").exists():
        return out
    out.mkdir(exist_ok=True)
    context.progress("OpenCV's SGBM HH4 on the same rectified pair")
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
    for name in ("left_rectified.png", "result.json"):
        shutil.copy(ours / name, out)
    return out


def judge(result, folder, scene, reply):
    """Object and whole picture (key "picture") against the truth; kept in the result's directory."""
    kept = result / "accuracy.json"
    if not kept.exists():
        sharp = f"{reply['near_sharp_mm']}:{reply['far_sharp_mm']}" if reply.get("near_sharp_mm") else "0:1e9"
        compare = [TOOLS / "simrig/compare", result, folder / "truth", "--json"]
        found = json.loads(run([*compare, "--object", scene, "--sharp", sharp]))
        found["picture"] = json.loads(run(compare))["kept"]
        kept.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    return json.loads(kept.read_text(encoding="utf-8"))
