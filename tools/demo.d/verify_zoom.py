#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Verifies a calibration of all zooms live, on the simulated rig, at two zooms that it has not seen.

usage: verify_zoom.py VERGENCE VERGENCED OUT

OUT is the directory that `vergence calibrate` wrote for the rig. The instrument gets its calibration, is
aimed, zoomed to the middle between two calibrated zooms, near the wide end and near the tele end, and
takes a pair of the board at each; `vergence calibrate --verify` compares them with what the calibration
predicts. Adds verify.txt (commands and replies), verify.json and a section of calibration.html.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

from rig import TOOLS, Failed, Instrument, run

BOARD = TOOLS.parent / "tests/data/zoom_capture/board.yaml"
BOARD_OPTIONS = ("--board", "10x7", "--square", "24", "--charuco", "4x4_50", "--marker", "17")
DISTANCE_MM = 1800


def unseen_zooms(out):
    """Zoom positions of the left lens in the middle of gaps, in counts."""
    settings = json.loads((out / "calibration.json").read_text(encoding="utf-8"))["left"]["settings"]
    zooms = sorted(setting["zoom_counts"] for setting in settings)
    return [round((zooms[i] + zooms[i + 1]) / 2) for i in (len(zooms) // 6, 2 * len(zooms) // 3)]


def take_pairs(vergence, vergenced, out, work, log):
    with Instrument((vergence, vergenced), work, BOARD, calibration=out / "instrument.zoom") as instrument:
        lines = ["bringup", f"aim distance={DISTANCE_MM}"]
        for number, zoom in enumerate(unseen_zooms(out), 1):
            lines += [f"zoom {zoom}", "iris f/8", "autoexpose", "autofocus", f"capture look_{number}"]
        for line in lines:
            print(f"   board> {line}", flush=True)
            log.append(f"> {line}\n{instrument.command(line)}")


def section(page):
    """Of the report."""
    rows = ""
    for look in page["verify"]:
        for name, key in (("as read", "read"), ("refined", "refined")):
            fit = look[key]
            rows += (f"<tr><th scope=row>{look['zoom']}</th><td>{name}</td>"
                     f"<td>{fit['square_mm'] - page['square_mm']:+.3f} mm</td>"
                     f"<td>{fit['square_sigma_mm']:.3f} mm</td><td>{fit['rows_px']:.3f} px</td>"
                     f"<td>{fit['rows_sigma_px']:.3f} px</td></tr>")
    return ("<section><h2>Verified at zooms that were not calibrated</h2><p>"
            f"{page['verdict']['sentence']} The rig was zoomed between two calibrated positions and "
            "took a pair of the board: how far its squares were off, and the rows of both pictures, "
            "with the cameras where the motors read, and refined as every pair is.</p>"
            '<div class="panel"><table><thead><tr><th>zoom</th><th></th><th>squares</th><th>predicted</th><th>rows</th>'
            f"<th>predicted</th></tr></thead><tbody>{rows}</tbody></table></div></section>")


def verify(vergence, vergenced, out):
    log = []
    with tempfile.TemporaryDirectory(prefix="vergence-demo-") as folder:
        work = pathlib.Path(folder) / "rig"
        take_pairs(vergence, vergenced, out, work, log)
        command = [vergence, "calibrate", work / "files/look_1", work / "files/look_2", *BOARD_OPTIONS,
                   "--verify", out / "instrument.zoom"]
        page = json.loads(run([*command, "--json"]))
        text = run(command)
    for look, zoom in zip(page["verify"], unseen_zooms(out)):
        look["zoom"] = zoom
    (out / "verify.txt").write_text("".join(log) + text, encoding="utf-8")
    (out / "verify.json").write_text(json.dumps(page, indent=2) + "\n", encoding="utf-8")
    report = out / "calibration.html"
    html = report.read_text(encoding="utf-8")
    report.write_text(html.replace("</main>", section(page) + "</main>", 1), encoding="utf-8")
    print(text, end="")


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__.strip())
    try:
        verify(*[pathlib.Path(word).resolve() for word in sys.argv[1:]])
    except (Failed, OSError, subprocess.TimeoutExpired) as error:
        sys.exit(f"verify_zoom: {error}")


if __name__ == "__main__":
    main()
