#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the whole chain on the simulated rig with the commands that a user would type.

usage: measure_rig.py VERGENCE VERGENCED OUT NAME...

NAME: cylinder_1x, cylinder_3x, mug_1x. For each scene `VERGENCE simulate` and VERGENCED start, dark and
out of focus; the instrument is brought up, aimed and zoomed, finds exposure and focus, and takes
pairs through the simulated FPGA; they are reconstructed with the world's true cameras as
calibration and compared with the world's shapes. Writes to OUT/rig_NAME, in addition to the files of `vergence
reconstruct`: console.txt (commands and replies), focus_curve.svg (also in report.html), accuracy.json
and accuracy/ (from tools/simrig/compare), true.calibration.
"""
import concurrent.futures
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

TOOLS = pathlib.Path(__file__).resolve().parents[1]
TIMEOUT_S = 600
# The lenses at the start: turned by hand, nearly closed and out of focus.
START = tuple(f"ring {side} {axis} {position}" for side, axis, position in
              (("left", "iris", 420), ("right", "iris", 440), ("left", "focus", 760),
               ("right", "focus", 380)))
# Both cameras look at the middle of the scene, 1.8 m away.
AIM = ("bringup", "pan 3.570 right=-3.272")
FIND = ("autoexpose", "autofocus", "autoexpose")
# Scene, settings, scale of the reconstruction: if the texture is fainter than the noise of a pixel, a
# smaller picture has less noise.
PAIRS = {
    "cylinder_1x": ("cylinder", ("zoom 1x", "iris f/2", *FIND), 1),
    "cylinder_3x": ("cylinder", ("zoom 3x", "iris f/7", *FIND), 0.5),
    "mug_1x": ("mug", ("zoom 1x", "iris f/2", *FIND), 0.7),
}
NEAR_MM, FAR_MM = "1600", "2600"


# Rigs and daemons to terminate when interrupted.
running = []


class Failed(Exception):
    """A step of the demo failed; the text says why."""


def run(command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          timeout=TIMEOUT_S, check=False, **options)
    if done.returncode != 0:
        raise Failed(f"{' '.join(map(str, command))}: {done.stdout}{done.stderr}".strip())
    return done.stdout


def start(command, log, ready):
    """Starts a program in the background and waits for the file `ready`."""
    with open(log, "w", encoding="utf-8") as file:
        program = subprocess.Popen([str(word) for word in command], stdout=file, stderr=file)
    running.append(program)
    for _ in range(600):
        if ready.exists() and program.poll() is None:
            return program
        if program.poll() is not None:
            break
        time.sleep(0.05)
    program.kill()
    program.wait()
    raise Failed(f"{command[0]}: {log.read_text(encoding='utf-8').strip() or 'does not answer'}")


def stop(program):
    program.terminate()
    try:
        program.wait(60)
    except subprocess.TimeoutExpired:
        program.kill()
        program.wait()


def take_pairs(programs, scene, names, threads, work):
    """Creates the session work/files/NAME, the truth work/NAME and a console log for each NAME."""
    rig, daemon = f"unix:{work}/rig.sock", f"unix:{work}/vergenced.sock"
    vergence, vergenced = programs
    started = [start([vergence, "simulate", scene, "--listen", rig, "--files", work, "--seed", "1",
                      "--threads", threads], work / "rig.log", work / "rig.sock")]
    try:
        started.append(start([vergenced, f"backend=sim {rig}", f"socket={work}/vergenced.sock",
                              f"files={work}/files", "store=none", "log=none"], work / "vergenced.log",
                             work / "vergenced.sock"))
        output_text = ""
        run([TOOLS / "simrig/control", rig, *START])
        for name in names:
            aim = AIM if name == names[0] else ()
            for line in (*aim, *PAIRS[name][1], "status", f"capture {name}"):
                print(f"   {scene}> {line}", flush=True)
                answer = run([vergence, "--connect", daemon, *line.split()])
                output_text += f"> {line}\n{answer}"
            run([TOOLS / "simrig/control", rig, "truth left left", "truth right right"])
            truth = work / name
            truth.mkdir()
            run([vergence, "--connect", daemon, "focus-curve", "last=yes"], cwd=truth)
            next(truth.glob("focus-curve-*.svg")).rename(truth / "focus_curve.svg")
            for path in (*work.glob("left*.*"), *work.glob("right*.*")):
                path.rename(truth / path.name)
            (truth / "console.txt").write_text(output_text, encoding="utf-8")
    finally:
        for program in reversed(started):
            stop(program)


def measure(vergence, out, name, work):
    """Reconstructs a session and measures the accuracy of the surface against its truth."""
    scene, _, scale = PAIRS[name]
    truth, session = work / name, work / "files" / name
    run([vergence, "info", truth, "--convert", truth / "true.calibration"])
    print(f"   {name}: reconstructing", flush=True)
    run([vergence, "reconstruct", session, "--calibration", truth / "true.calibration", "--near",
         NEAR_MM, "--far", FAR_MM, "--scale", scale, "--out", out, "--quiet"])
    table = run([TOOLS / "simrig/compare", out, truth, "--object", scene, "--json", "--out",
                 out / "accuracy"])
    (out / "accuracy.json").write_text(table, encoding="utf-8")
    for kept in ("console.txt", "focus_curve.svg", "true.calibration"):
        shutil.copy(truth / kept, out)
    report = out / "report.html"
    text = report.read_text(encoding="utf-8")
    curve = ("<section><h2>Focus</h2><p>Sharpness against the position of the focus rings, as "
             "autofocus measured it.</p>" + (out / "focus_curve.svg").read_text(encoding="utf-8") +
             "</section>")
    report.write_text(text.replace("</main>", curve + "</main>", 1), encoding="utf-8")


def measure_scene(programs, out, scene, names, threads):
    with tempfile.TemporaryDirectory(prefix="vergence-demo-") as work:
        work = pathlib.Path(work)
        take_pairs(programs, scene, names, threads, work)
        for name in names:
            measure(programs[0], out / f"rig_{name}", name, work)


def main():
    names = sys.argv[4:]
    if not names or any(name not in PAIRS for name in names):
        sys.exit(__doc__.strip())
    *programs, out = [pathlib.Path(word).resolve() for word in sys.argv[1:4]]
    scenes = {}
    for name in names:
        scenes.setdefault(PAIRS[name][0], []).append(name)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    # Each rig simulates its bridge on one processor and renders pictures on the remaining ones.
    threads = max(1, (os.cpu_count() or 1) // len(scenes))
    with concurrent.futures.ThreadPoolExecutor(len(scenes)) as pool:
        works = [pool.submit(measure_scene, programs, out, scene, of_scene, threads)
                 for scene, of_scene in scenes.items()]
        try:
            for work in works:
                work.result()
        except (Failed, OSError, subprocess.TimeoutExpired) as error:
            sys.exit(f"measure_rig: {error}")
        except KeyboardInterrupt:
            # Without these programs the workers finish.
            for program in running:
                program.terminate()
            sys.exit(130)


if __name__ == "__main__":
    main()
