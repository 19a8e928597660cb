# SPDX-License-Identifier: Apache-2.0
"""The whole chain on the instrument's own processor: bring-up, pan, zoom by what is wanted, exposure, focus, a pair
by DMA, its surface by the calibration of all zooms. The surface is that which a PC makes of the same pair, byte for
byte."""
import json
import math
import os
import pathlib
import re
import subprocess
import tempfile
import unittest
import zlib

from bf537_board import Board, require_tool_chain
from waiting import TIMEOUT_S

setUpModule = require_tool_chain
RIG = ("--scene", "cylinder", "--rig", "perfect")
AIM = ("window 96 96", "pan 3.97 right=-3.97", "zoom density=3 distance=1800", "autoexpose")
SEARCH = {"near": "1700", "far": "1900", "preset": "board", "scale": "0.5"}
DISTANCE_MM = 1800


def calibration():
    """The perfect rig's of all zooms, but for its lenses, whose image distance does not change with focus."""
    wide_px, tele_px = 8.5 / 0.0032, 85 / 0.0032
    lines = ["vergence-zoom-calibration 2", "id chain", "date unknown", "note", "instrument rig"]
    for side, x_mm in ("left", 0), ("right", 250):
        none = f"{0:.12f}"
        values = {
            "camera": "unknown", "sensor_px": "2048 1536", "radius_px": "1280.000000", "pixel_mm": "0.003200000",
            "zoom_counts": "300.000 850.000", "focus_counts": "300.000 850.000",
            "log_focal_range": f"{math.log(wide_px):.12f} {math.log(tele_px):.12f}",
            "pan_rad": "-0.349065850 0.349065850",
            "focal": f"{0:.9f} {(tele_px + wide_px) / 2:.9f} {(tele_px - wide_px) / 2:.9f}",
            # 0.8 m at the end of the range, infinity at its begin.
            "focus_dioptre": f"{none} {0.625:.12f}", "focus_dioptre_by_count": f"{0.625:.12f} {none}",
            "centre_x": f"{0:.9f} {1023.5:.9f}", "centre_y": f"{0:.9f} {767.5:.9f}",
            **{name: f"{0:.9f}" for name in ("radial_2", "radial_4", "radial_6", "tangential_1", "tangential_2",
                                             "pupil")},
            "axis_direction": f"{none} {none}", "axis_point_mm": f"{x_mm:.9f} {0:.9f}", "pan_scale": none,
            "rotation_rad": f"{none} {none} {none}", "position_mm": f"{x_mm:.9f} {0:.9f} {0:.9f}",
            "reading_sigma_counts": "0.250000", "drift_sigma_counts": "1.000000", "pan_sigma_rad": "0.005235988",
            "creep_sigma_rad": "0.000001000"}
        lines += [f"{side}_{name} {value}" for name, value in values.items()]
    lines += ["scale_sigma 0.000200000", "settings 13", "boards 156", "corners 15600", "rejected_corners 0",
              "rms_px 0.150000", "held_out_px 0.050000", "held_out_focal 0.000300000", "chi_square_z 0.000",
              "parameters 0"]
    body = "".join(line + "\n" for line in lines)
    return body + f"crc32 {zlib.crc32(body.encode()):08x}\n"


def vergence(*words, folder):
    return subprocess.run([os.environ["VERGENCE"], *words], check=True, capture_output=True, text=True, cwd=folder,
                          timeout=TIMEOUT_S).stdout


class Chain(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_the_surface_is_that_of_a_pc(self):
        board = Board(RIG)
        self.addCleanup(board.close)
        board.wait_prompt()
        self.assertRegex(board.type("reconstruct"), "ERR MISSING reconstruct: no pair")
        self.assertRegex(board.type("bringup"), r"\nOK\n")
        self.assertRegex(board.type("zoom fit=100 distance=1800"), "ERR MISSING zoom: .* calibration")

        def client(*words):
            done = board.client(*words, cwd=self.folder)
            self.assertEqual(done.returncode, 0, (words, done.stdout, done.stderr))
            return done.stdout

        (self.folder / "chain.zoom").write_text(calibration())
        client("send", "chain.zoom")
        self.assertIn("id: chain", client("calibration", "set", "chain.zoom"))
        for line in AIM:
            self.assertRegex(board.type(line), r"\nOK\n", line)
        for mm in re.findall(r"verdict: focused\n(?:.*\n){3}  distance: ([\d.]+) mm\n", board.type("autofocus")):
            self.assertAlmostEqual(float(mm), DISTANCE_MM, delta=0.02 * DISTANCE_MM)
        self.assertRegex(board.type("window 160 120"), r"\nOK\n")
        self.assertRegex(board.type("capture"), r"width: 160 px\n")
        client("fetch", "pair-1")
        client("reconstruct", *(f"{name}={value}" for name, value in SEARCH.items()), "--out", "dsp")
        result = json.loads((self.folder / "dsp/result.json").read_text())
        self.assertGreater(result["counts"]["vertices"], 4000, result["counts"])
        self.assertAlmostEqual(result["depth_mm"]["median"], DISTANCE_MM, delta=0.02 * DISTANCE_MM)
        (self.folder / "state.txt").write_text(result["calibration"]["text"])
        vergence("reconstruct", "pair-1/left.pgm", "pair-1/right.pgm", "--bayer", "grbg", "--calibration", "state.txt",
                 *(word for name, value in SEARCH.items() for word in (f"--{name}", value)), "--out", "pc",
                 folder=self.folder)
        for name in ("disparity.pfm", "reasons.png", "depth.png"):
            self.assertEqual((self.folder / "dsp" / name).read_bytes(), (self.folder / "pc" / name).read_bytes(), name)


if __name__ == "__main__":
    unittest.main()
