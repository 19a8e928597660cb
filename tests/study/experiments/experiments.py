#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""usage: experiments.py BUILD [--runs N] [--seed N] [--jobs N] [--only REGEX] [--quick] [--board] [--out DIR]
                      [--write FILE]
       experiments.py [--only REGEX] --list

Measures the objects of tools/figures on the simulated rig by one `measure` each, with N seeds: each has its own
noise, servos, motors, lights, place and turn of the object, and side of its ornament. Prints a table against the
truth. A measurement that DIR has is not made again, so that an interrupted campaign continues, and more runs
can be added; one that failed is, since the machine may have been too busy to simulate. --write replaces what is
below the mark of FILE. --board puts a small board beside each object, and states the error without and with it.
The rig is measured with the calibration that `vergence calibrate` solves from tests/data/zoom_capture: it is the
same instrument, switched on again.

Exit code: 0; 1 when a measurement ended without a surface; 2 for wrong usage.
"""
import concurrent.futures
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tools/figures.d"), str(ROOT / "tools/demo.d")]
sys.dont_write_bytecode = True

import measured  # noqa: E402
from figure import Context, Options, write_whole  # noqa: E402
from figure_surfaces import ROWS  # noqa: E402
from rig import Failed, interrupt, run  # noqa: E402

SCENES = ROOT / "tools/simrig/scenes"
MARK = "<!-- figures -->"
# Degrees by which an object may be turned about its height: all of the cylinder is painted.
TURNS = {"cylinder": 180, "mug": 25, "figurine": 40, "level": 20}
LIGHTS, PLACE_MM = (0.6, 1.6), (40, 60)
LARGE = {"m", "m-surface", "m-board", "truth"}
# A board of so many squares, whose width is this part of what the cameras see of the object.
BOARD, BOARD_PART = (8, 6), 0.2


def board_square_mm(width_mm):
    return round(BOARD_PART * width_mm / (BOARD[0] + 1), 1)


def with_board(head, body, place_mm, width_mm):
    """The scene with a board to the left of the object, which is at x and z."""
    square_mm = board_square_mm(width_mm)
    columns, rows = BOARD
    print_ = (f"  - print: {{kind: board, colours: [[0.82, 0.82, 0.80], [0.035, 0.035, 0.04]], "
              f"board: {{columns: {columns}, rows: {rows}, square_mm: {square_mm}}}}}\n")
    size = [(columns + 1) * square_mm, (rows + 1) * square_mm]
    sheet = (f"  - sheet: {{name: board, material: print, position_mm: [{place_mm[0] - 0.38 * width_mm:.1f}, "
             f"{-size[1] / 2 - 5:.1f}, {place_mm[1]:.1f}], turn_deg: [0, 0, 0], size_mm: {size}}}\n")
    materials, name, objects = head.partition("objects:\n")
    return materials + print_ + name + sheet + objects, body


def vary(scene, seed, folder, board_width_mm=0):
    """Writes the scene with other lights, place and turn, and with a board if its object is seen so wide; returns
    its path."""
    chance = random.Random(f"{scene} {seed}")
    text = (SCENES / f"{scene}.yaml").read_text(encoding="utf-8")
    factor = chance.uniform(*LIGHTS)

    def brighter(found):
        values = ", ".join(f"{float(value) * factor * chance.uniform(0.9, 1.1):.1f}" for value in
                           found[2].split(","))
        return f"{found[1]}[{values}]"
    text = re.sub(r"(luminance: )\[([^]]*)\]", brighter, text)
    text = re.sub(r"(ambient: )\[([^]]*)\]", brighter, text)
    across, along = (chance.uniform(-limit, limit) for limit in PLACE_MM)
    turn = chance.uniform(-TURNS[scene], TURNS[scene])
    head, name, body = text.partition(f"      name: {scene}\n")
    if board_width_mm:
        at = re.search(r"position_mm: \[([^,]*), [^,]*, ([^]]*)\]", body)
        place = float(at[1]) + across, float(at[2]) + along
        head, body = with_board(head, body, place, board_width_mm)
    body = re.sub(r"position_mm: \[([^,]*), ([^,]*), ([^]]*)\]", lambda found: (
        f"position_mm: [{float(found[1]) + across:.1f}, {found[2]}, {float(found[3]) + along:.1f}]"), body, count=1)
    body = re.sub(r"turn_deg: \[0, ([^,]*), 0\]", lambda found: f"turn_deg: [0, {float(found[1]) + turn:.1f}, 0]",
                  body, count=1)
    for image in re.findall(r"image: (\w+\.png)", head):
        shutil.copy(SCENES / image, folder)
    path = folder / f"{scene}.yaml"
    path.write_text(head + name + body, encoding="utf-8")
    return path


def with_known_size(context, scene, width_mm, reply):
    """The judgement of the same pairs, made with the board in view."""
    out = context.folder / "m-board"
    run([context.program("vergence"), "measure", context.folder / "m", "--board",
         f"{BOARD[0] - 1}x{BOARD[1] - 1}", "--square", str(board_square_mm(width_mm)), "--out", out, "--quiet"])
    return measured.judge(out, context.folder, scene, reply)


def experiment(context, scene, width_mm, board):
    """The reply and its judgement; or why there is none. Only these are kept."""
    kept = context.folder / "experiment.json"
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    shutil.rmtree(context.folder, ignore_errors=True)
    context.folder.mkdir(parents=True)
    try:
        reply = measured.measure(context, vary(scene, context.seed, context.folder, board * width_mm),
                                 context.measurement(f"--fit {width_mm}"), context.folder)
        found = {"reply": reply,
                 "judged": measured.judge(context.folder / "m-surface", context.folder, scene, reply)}
        if board:
            found["board"] = with_known_size(context, scene, width_mm, reply)
    except Failed as error:
        if "interrupted" in str(error):
            raise
        return {"failed": str(error)[-400:]}
    write_whole(kept, json.dumps(found))
    for name in LARGE:
        shutil.rmtree(context.folder / name, ignore_errors=True)
    return found


def middle(values, digits):
    values = [value for value in values if value is not None]
    return "-" if not values else f"{np.median(values):.{digits}f}"


def row(name, found):
    good = [one for one in found if "judged" in one]
    judged = [one["judged"] for one in good]

    def of(group, key, fit=True):
        return [((one[group] or {}).get("fit") or {}).get(key) if fit else (one[group] or {}).get(key)
                for one in judged]
    ratios = [value for value in of("common", "ratio", False) if value is not None]
    rms = f"{np.sqrt(np.mean(np.square(ratios))):.2f}, {np.max(np.abs(ratios)):.1f}" if ratios else "-"
    with_board = [one["board"]["visible"]["rms_mm"] for one in good if "board" in one]
    known = f", {middle(with_board, 2)}" if with_board else ""
    parts = [[((one["parts"] or {}).get(part) or {}).get("measured_percent") for one in judged]
             for part in ("bright", "dark")]
    return (f"| {name} | {len(good)} of {len(found)} | {middle(of('visible_textured', 'median_error_px'), 3)} | "
            f"{middle(of('visible', 'rms_mm', False), 1)}{known} | {rms} | "
            f"{middle(of('visible', 'wrong_3px_percent'), 2)} | "
            f"{middle(of('visible', 'measured_percent', False), 1)}, "
            f"{middle(of('visible_textured', 'measured_percent', False), 1)} | "
            f"{middle(parts[0], 1)}, {middle(parts[1], 1)} | {middle([one['reply']['seconds'] for one in good], 0)} |")


def table(results):
    """Medians over the runs; of `common` rms and greatest."""
    lines = ["| object, mm | good | after similarity, textured, px | rms, mm (with a board) | error of all depths "
             "over sigma: rms, most | wrong, % | visible measured, of it with texture, % | bright, dark parts, % | rig "
             "time, s |",
             "|---|---|---|---|---|---|---|---|---|"]
    names = list(dict.fromkeys(name for name, _ in results))
    lines += [row(name, [found for other, found in results if other == name]) for name in names]
    lines.append(row("all", [found for _, found in results]))
    return "\n".join(lines) + "\n"


def options_of(words):
    cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache")
    parser = Options("experiments.py")
    parser.add_argument("build", type=pathlib.Path, nargs="?")
    parser.add_argument("--runs", type=Options.count, default=20)
    parser.add_argument("--out", type=pathlib.Path, default=cache / "vergence/experiments")
    parser.add_argument("--board", action="store_true")
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args(words)
    options.names = [(scene, width) for _, scene, widths in ROWS for width in widths
                     if options.only.fullmatch(f"{scene}_{width}")]
    if not options.names:
        parser.error("--only matches no measurement of --list")
    return options


def main():
    options = options_of(sys.argv[1:])
    if options.list and not options.help:
        print("\n".join(f"{scene}_{width}" for scene, width in options.names))
        return 0
    if options.help or not options.build:
        print(__doc__, end="")
        return 0 if options.help else 2
    solved = options.out / "calibrated"
    if not (solved / "instrument.zoom").exists():
        options.out.mkdir(parents=True, exist_ok=True)
        measured.calibrate(options.build, solved)
    pool = concurrent.futures.ThreadPoolExecutor(options.jobs)
    work = {}
    kind = ("-quick" if options.quick else "") + ("-board" if options.board else "")
    for seed in range(options.seed, options.seed + options.runs):
        for scene, width in options.names:
            context = Context(options.build.resolve(), solved.resolve(),
                              options.out.resolve() / f"{scene}_{width}-{seed}{kind}", seed, 1, options.quick)
            work[pool.submit(experiment, context, scene, width, options.board)] = f"{scene} {width}"
    results = []
    try:
        for done in concurrent.futures.as_completed(work):
            results.append((work[done], done.result()))
            print(f"== {len(results)} of {len(work)}: {work[done]}", flush=True)
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        interrupt()
        raise
    text = table(sorted(results, key=lambda item: list(work.values()).index(item[0])))
    print(text)
    if options.write:
        page = options.write.read_text(encoding="utf-8").partition(MARK)[0]
        options.write.write_text(f"{page}{MARK}\n\n`tools/campaign experiments --runs {options.runs} --seed "
                                 f"{options.seed}{kind.replace('-', ' --')}`:\n\n{text}", encoding="utf-8")
    return 1 if any("failed" in found for _, found in results) else 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        sys.exit(main())
    except (Failed, OSError, subprocess.TimeoutExpired) as error:
        sys.exit(f"experiments: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
