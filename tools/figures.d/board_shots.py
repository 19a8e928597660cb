# SPDX-License-Identifier: Apache-2.0
"""Pairs that the simulated rig takes at stated zooms, and the demo's board in them."""
import contextlib
import json
import shutil
import tempfile
from pathlib import Path

import cv2
import numpy as np

from rig import TOOLS, Instrument, run

CAPTURE = TOOLS.parent / "tests/data/zoom_capture"
BOARD = ("--board", "10x7", "--square", "24", "--charuco", "4x4_50", "--marker", "17")
COLUMNS, SQUARE_MM, MARKER_MM = 10, 24, 17


@contextlib.contextmanager
def instrument(context, scene):
    with tempfile.TemporaryDirectory(prefix="vergence-figures-") as work:
        with Instrument((context.program("vergence"), context.program("vergenced")), Path(work), scene,
                        context.seed, context.calibration / "instrument.zoom", context.threads) as rig:
            yield rig


def keep(rig, session):
    """Moves the session of that name from the instrument's files: whole, or not at all."""
    part = session.with_name(session.name + ".part")
    shutil.rmtree(part, ignore_errors=True)
    shutil.move(rig.files / session.name, part)  # may copy: the temporary folder has its own disk
    part.replace(session)


def take(context, scene, zooms, distance_mm, right_mm=0):
    """A session with a pair for each of the commands `zooms`, aimed at the distance; from the folder if it is
    there. The replies to the commands are in replies.json beside it."""
    session = context.folder / "session"
    if session.exists():
        return session
    with instrument(context, scene) as rig:
        replies = []
        for line in ("bringup", f"aim distance={distance_mm} right={right_mm}", "iris f/5.6"):
            rig.command(line)
        for number, line in enumerate(zooms):
            context.progress(f"{Path(scene).stem}> {line}")
            replies.append(rig.figures(line))
            if number == 0:  # the f-number stays
                rig.command("autoexpose iris=no")
            rig.command(f"capture session{' add=yes' if number else ''}")
        (context.folder / "replies.json").write_text(json.dumps(replies, indent=2) + "\n", encoding="utf-8")
        keep(rig, session)
    return session


def reconstructed(context, session, number, *words):
    """result.json of a pair's surface, in the folder under the session's name and the pair's number."""
    out = context.folder / f"{session.name}_{number}"
    if not (out / "result.json").exists():
        run([context.program("vergence"), "reconstruct", session, "--pair", str(number), "--calibration",
             context.calibration / "instrument.zoom", *words, "--out", out, "--quiet"])
    return json.loads((out / "result.json").read_text(encoding="utf-8"))


def pictures(session, number):
    """Both frames of a pair as grey pictures of 8 bits."""
    index = [line for line in (session / "session.index").read_text(encoding="utf-8").splitlines()
             if line.startswith(f"pair number={number} ")]
    found = []
    for side in ("left", "right"):
        name = index[0].split(f" {side}_frame=")[1].split()[0]
        raw = cv2.imread(str(session / f"frame-{name}.pnm"), cv2.IMREAD_UNCHANGED)
        bright = np.percentile(raw, 99.5)
        grey = cv2.cvtColor(np.clip(raw / bright * 235, 0, 255).astype(np.uint8), cv2.COLOR_BayerGB2GRAY)
        found.append(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR))
    return found


def opencv_corners(picture):
    """Corner number -> position, by OpenCV's detector, which is not ours."""
    words = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    board = cv2.aruco.CharucoBoard_create(COLUMNS + 1, 8, SQUARE_MM, MARKER_MM, words)
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    markers, numbers, _ = cv2.aruco.detectMarkers(grey, words)
    if numbers is None:
        return {}
    count, corners, found = cv2.aruco.interpolateCornersCharuco(markers, numbers, grey, board)
    return {int(number): corner[0] for number, corner in zip(found.ravel(), corners)} if count else {}


def corners_of(path):
    """Of a file of corners: picture -> corner number -> position, in the file's order."""
    found, seen = {}, {}
    for line in path.read_text(encoding="ascii").splitlines():
        if not line.startswith("#"):
            name, x, y = line.split()[:3]
            number = seen[name] = seen.get(name, -1) + 1
            if x != "-":
                found.setdefault(name, {})[number] = (float(x), float(y))
    return found


def detect(context, session, number):
    """The corners that the product's detector finds in both pictures of a pair, by number."""
    out = context.folder / f"corners_{number}"
    if not (out / "corners.vnl").exists():
        run([context.program("vergence"), "calibrate", f"{session}:{number}", *BOARD, "--touch-up",
             context.calibration / "instrument.zoom", "--out", out, "--quiet"])
    return list(corners_of(out / "corners.vnl").values())
