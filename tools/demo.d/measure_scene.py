#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures an object in front of the simulated rig with one command, and judges the surface.

usage: measure_scene.py VERGENCE VERGENCED CALIBRATION OUT SCENE [WORD...]

`VERGENCE simulate SCENE` and VERGENCED start: cold, dark, out of focus, with the result directory CALIBRATION
of `vergence calibrate`. `VERGENCE --connect measure SCENE WORD...` does everything else. Writes the surface to
OUT, and to it console.txt (command and reply), measured.json (the truth's judgement by tools/simrig/compare)
and accuracy/ (its pictures).
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

from rig import TOOLS, Failed, Instrument, run


def measure(programs, calibration, out, scene, words):
    with tempfile.TemporaryDirectory(prefix="vergence-demo-") as folder:
        work, here = pathlib.Path(folder) / "rig", pathlib.Path(folder) / "here"
        here.mkdir()
        with Instrument(programs, work, scene, calibration=calibration / "instrument.zoom") as instrument:
            line = " ".join(("measure", scene, *words))
            print(f"   {scene}> {line}", flush=True)
            reply = instrument.command(f"{line} --out {out}", cwd=here)
            print("".join(f"   {text}\n" for text in reply.splitlines()), end="", flush=True)
            (out / "console.txt").write_text(f"> {line}\n{reply}", encoding="utf-8")
            session = here / scene
            instrument.truth(session, pair_of(session), work / "truth")
        table = json.loads(run([TOOLS / "simrig/compare", out, work / "truth", "--object", scene, "--json",
                                "--out", out / "accuracy"]))
    (out / "measured.json").write_text(json.dumps(table, indent=2) + "\n", encoding="utf-8")


def pair_of(session):
    """Which pair of the session was measured: what `measure` noted last."""
    index = (session / "session.index").read_text(encoding="utf-8")
    found = re.findall(r"measure%20surface%20pair=(\d+)", index)
    if not found:
        raise Failed(f"{session}: notes no surface")
    return int(found[-1])


def main():
    if len(sys.argv) < 6:
        sys.exit(__doc__.strip())
    vergence, vergenced, calibration, out = [pathlib.Path(word).resolve() for word in sys.argv[1:5]]
    try:
        measure((vergence, vergenced), calibration, out, sys.argv[5], sys.argv[6:])
    except (Failed, OSError, subprocess.TimeoutExpired) as error:
        sys.exit(f"measure_scene: {error}")
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
