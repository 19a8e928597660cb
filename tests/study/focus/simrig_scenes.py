# SPDX-License-Identifier: Apache-2.0
"""usage: simrig_scenes.py BUILD [--runs N] [--seed N] [--jobs N] [--scene N] [--region PX]
                        [--hard] [--keep DIR] [--list]

Focuses one lens of the simulated rig with the daemon's `autofocus` on random scenes: textures from
white noise to 1/f^1.5, steps, two depths and flat ones, at any zoom, iris and distance, with play
of 0 to 8 counts, reading noise of 1.5, potentiometers that are 3 counts off, and light that
flickers by 6 %. The rig itself says where the ring is sharp. Prints rows of a Markdown table.

--hard runs 40 scenes instead: 16 like these, and 24 with lamps, in the dark, far away, nearer than
the lens can focus, with two depths, flat, repetitive and with little light. What a person would
focus by hand and the instrument does not is missed.

BUILD holds the programs simrig, simrig-render, vergenced and vergence-board (a build with
-DVERGENCE_FPGA=ON). --scene runs only the scene of that number, --keep leaves its files in DIR,
--list also prints a line for each scene. A scene takes 10 to 25 CPU seconds with regions of 100 px
(the default), half of it with 64. Exit code: 1 if a lens that is not sharp was reported as focused.
"""
import argparse
import concurrent.futures
import json
import math
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time

import cv2
import numpy

ROOT = pathlib.Path(__file__).resolve().parents[3]
SIMRIG = ROOT / "tools" / "simrig"
MIDDLE_PX = (1024, 768)
PIXEL_MM, WELL_E, E_PER_LUX_S, BLACK_DN = 0.0032, 8500, 17000, 42
TRANSMISSION = 0.88
LONGEST_US = 150000
START_S, ANSWER_S = 60, 900
SHARP_PX = 1  # diameter of a blur that counts as sharp
FALSE_PX = 2  # more than the best reachable: `focused` is false
STEP_COUNTS = 2
HARD = (["noise"] * 12 + ["step"] * 4 + ["lamps"] * 4 + ["dark"] * 4 + ["far"] * 3 + ["near"] * 3 +
        ["two depths"] * 3 + ["flat"] * 3 + ["bars"] * 2 + ["low light"] * 2)
KINDS = ("noise", "noise", "noise", "noise", "step", "two depths", "flat", "faint")


def focal_mm(zoom):
    return 8.5 + 76.5 * (zoom - 300) / 550


def f_number(zoom, iris):
    f_open = 1.6 + 0.4 * (zoom - 300) / 550
    return f_open * (16 / f_open) ** ((850 - iris) / 550)


class Scene:
    """What a random scene shows, and how its rig is set."""

    def __init__(self, seed, number, region_px, hard=False):
        random = numpy.random.default_rng((seed, number))
        self.number, self.seed = number, int(random.integers(1 << 31))
        # Column, row, columns, rows of the array.
        self.region = tuple((middle - region_px // 2) // 2 * 2 for middle in MIDDLE_PX) + (
            region_px, region_px)
        self.kind = str(random.choice(KINDS))
        self.side = str(random.choice(("left", "right")))
        self.zoom = float(300 + 550 * (10 ** random.uniform() - 1) / 9)
        self.iris = float(850 if random.uniform() < 0.3 else random.uniform(300, 850))
        self.focus = float(random.uniform(300, 850))
        # As much distance as there is travel of the ring.
        self.distance_mm = 800 / float(random.uniform(0.12, 0.98))
        self.behind_mm = self.distance_mm * float(random.uniform(1.1, 2))
        self.slope = float(random.choice((0, random.uniform(0, 1.5))))
        self.contrast = float(0.12 * 4 ** random.uniform())
        if self.kind == "faint":
            self.contrast = float(0.002 * 8 ** random.uniform())
        self.split_px, self.slant_deg = float(random.uniform(-20, 20)), float(random.uniform(1, 9))
        self.texel_px = float(random.uniform(0.8, 2.5))
        stops = (f_number(self.zoom, self.iris) / 2) ** 2
        self.exposure_us = min(500 * 16 ** float(random.uniform()) * stops, LONGEST_US)
        if self.exposure_us > 10000 and random.uniform() < 0.8:
            self.exposure_us = self.exposure_us // 10000 * 10000
        self.gain = float(random.choice((1, 1, 2, 4)))
        self.level = float(random.choice((random.uniform(0.25, 0.6), random.uniform(0.05, 0.25),
                                          random.uniform(0.6, 1.1)), p=(0.75, 0.15, 0.1)))
        self.lamps = []
        if hard:
            self.kind = HARD[number % len(HARD)]
            self.make_hard(random)
        self.motors = {axis: (float(random.uniform(0, 8)), float(random.uniform(-3, 3)))
                       for axis in ("zoom", "focus", "iris")}

    def make_hard(self, random):
        """What a kind of scene needs, the rest being as drawn."""
        self.contrast = max(self.contrast, 0.12)
        if self.kind == "lamps":
            self.zoom, self.iris = float(random.uniform(500, 850)), 850.0
            self.distance_mm = float(random.uniform(1500, 4000))
            self.contrast = float(random.choice((0, 0.12)))
            # Fewer than 64 objects; size, distance from one to the next and brightness in pixels and
            # times that of the wall.
            step_px, size_px = random.uniform(60, 250), random.uniform(4, 30)
            brightness = 10 ** float(random.uniform(1, 3.5))
            across = [(i - random.uniform(3.2, 3.8)) * step_px for i in range(7)]
            self.lamps = [(x, y, size_px, brightness) for x in across for y in across]
            self.level = 10 ** float(random.uniform(-2.5, -0.5))
        elif self.kind in ("dark", "low light"):
            dark = self.kind == "dark"
            self.zoom = float(random.uniform(300, 850 if not dark else 600))
            self.exposure_us = LONGEST_US if dark else float(random.choice((40000, 100000)))
            self.gain = 8.0 if dark else 4.0
            self.level = float(random.uniform(0.15, 0.4) if dark else random.uniform(0.1, 0.3))
            self.contrast = float(random.uniform(0.25, 0.45))
        elif self.kind == "far":
            self.zoom, self.iris = float(random.uniform(600, 850)), 850.0
            self.distance_mm = 10000 * 6 ** float(random.uniform())
        elif self.kind == "near":
            self.zoom, self.iris = float(random.uniform(450, 850)), 850.0
            self.distance_mm = float(random.uniform(450, 740))
        if self.kind not in ("dark", "low light", "lamps"):
            self.level = float(random.uniform(0.25, 0.6))

    def text(self):
        return (f"{self.number:4d} {self.kind:10s} {self.side:5s} zoom {self.zoom:3.0f} "
                f"f/{f_number(self.zoom, self.iris):4.1f} {self.distance_mm:5.0f} mm "
                f"contrast {self.contrast:.3f} 1/f^{self.slope:.1f}")

    def luminance(self):
        """Of the room, so that the window's mean is `level` of the range."""
        lux = (self.level * WELL_E / self.gain / (E_PER_LUX_S * self.exposure_us * 1e-6))
        return lux * 4 * f_number(self.zoom, self.iris) ** 2 / (math.pi * TRANSMISSION) / 0.4

    def picture(self, size):
        """Reflectance of mean 0.4, repeating from right to left."""
        random = numpy.random.default_rng(self.seed)
        if self.kind == "flat":
            return numpy.full((size, size), 0.4)
        if self.kind == "step":
            y, x = numpy.mgrid[:size, :size] - size / 2
            turn = math.radians(self.slant_deg)
            right = (x * math.cos(turn) + y * math.sin(turn)) * self.texel_px > self.split_px
            return 0.4 * (1 + self.contrast * numpy.where(right, 1, -1))
        if self.kind == "bars":
            bars = numpy.arange(size) // 8 % 2 * 2 - 1
            return numpy.tile(0.4 * (1 + self.contrast * bars), (size, 1))
        white = numpy.fft.fft2(random.normal(size=(size, size)))
        radius = numpy.hypot(*numpy.meshgrid(numpy.fft.fftfreq(size), numpy.fft.fftfreq(size)))
        radius[0, 0] = 1
        noise = numpy.fft.ifft2(white * radius ** -self.slope).real
        noise -= noise.mean()
        # The contrast is that of a part as large as the window.
        part = max(8, int(self.region[2] / self.texel_px))
        local = noise[:part * (size // part), :part * (size // part)].reshape(
            size // part, part, size // part, part)
        local = local - local.mean(axis=(1, 3), keepdims=True)
        return 0.4 * (1 + self.contrast * noise / local.std())

    def write(self, folder):
        size = 1024
        root = 255 * numpy.sqrt(numpy.clip(self.picture(size), 0.01, 1))
        # The rounding to 8 bits must not be a texture of its own.
        root += numpy.random.default_rng(self.seed + 1).uniform(-0.5, 0.5, root.shape) * (
            self.kind not in ("flat", "faint"))
        cv2.imwrite(str(folder / "texture.png"), numpy.repeat(
            numpy.round(root).astype(numpy.uint8)[:, :, None], 3, axis=2))
        x_mm = 0 if self.side == "left" else 250

        def sheet(name, distance_mm, aside_mm):
            pixel_mm = distance_mm * PIXEL_MM / focal_mm(self.zoom)
            side_mm = min(max(size * self.texel_px * pixel_mm, 20), 2000)
            material = (f"  - {name}: {{kind: painted, contrast: 0, colours: [[0.4, 0.4, 0.4]], "
                        f"image: texture.png, image_size_mm: [{side_mm}, {side_mm}]}}\n")
            place = (f"  - sheet: {{name: {name}, material: {name}, size_mm: [6000, 6000], "
                     f"position_mm: [{x_mm + aside_mm}, 0, {distance_mm}]}}\n")
            return material, place
        sheets = [sheet("near", self.distance_mm, 0)]
        if self.kind == "two depths":
            pixel_mm = self.distance_mm * PIXEL_MM / focal_mm(self.zoom)
            sheets = [sheet("near", self.distance_mm, self.split_px * pixel_mm - 3000),
                      sheet("far", self.behind_mm, 0)]
        pixel_mm = self.distance_mm * PIXEL_MM / focal_mm(self.zoom)
        for i, (x_px, y_px, size_px, brightness) in enumerate(self.lamps):
            side_mm = size_px * pixel_mm
            sheets.append((
                f"  - lamp{i}: {{kind: paper, contrast: 0, colours: [[0.8, 0.8, 0.8]], brightness: "
                f"{brightness / 2}}}\n",
                f"  - sheet: {{name: lamp{i}, material: lamp{i}, size_mm: [{side_mm}, {side_mm}], "
                f"position_mm: [{x_mm + x_px * pixel_mm}, {y_px * pixel_mm}, "
                f"{self.distance_mm - 1}]}}\n"))
        light = f"[{self.luminance()}, {self.luminance()}, {self.luminance()}]"
        (folder / "scene.yaml").write_text(
            "room: {origin_mm: [0, 0, 0], tilt_deg: 0}\nlights: []\n"
            f"ambient: {light}\nfloor_ambient: {light}\nbounce_lux: 0\nmaterials:\n"
            + "".join(material for material, _ in sheets) + "objects:\n"
            + "".join(place for _, place in sheets), encoding="utf-8")
        rig = (SIMRIG / "rigs" / "default.yaml").read_text(encoding="utf-8")
        # Both cameras look straight ahead.
        for key, value in (("turn_deg", "[0, 0, 0]"), ("axis_direction", "[0, 1, 0]"),
                           ("offset_deg", "0"), ("centre_offset_px", "[0, 0]"),
                           ("centre_wander_px", "[0, 0]")):
            rig = re.sub(rf"^( *{key}:) *(\[[^\]]*\]|[^ #\n]+)", rf"\1 {value}", rig, flags=re.M)
        rig = rig.replace("pupil_mm: [250, 0.8, -0.5]", "pupil_mm: [250, 0, 0]")
        rig = rig.replace("read_noise_counts: 1,", "read_noise_counts: 1.5,")
        for axis, (play, drift) in self.motors.items():
            rig = re.sub(rf"(    {axis}: {{[^}}]*backlash_counts:) [\d.]+", rf"\1 {play}", rig)
            rig = re.sub(rf"(    {axis}: {{[^}}]*drift_counts:) [\d.]+", rf"\1 {drift}", rig)
        (folder / "rig.yaml").write_text(rig, encoding="utf-8")
        (folder / "exact.yaml").write_text(
            re.sub(r"(prnu|row_noise_e): [\d.]+", r"\1: 0", rig), encoding="utf-8")
        # The window may show what the lens's other start positions do not.
        (folder / "script").write_text("".join(
            f"ring {side} {axis} {getattr(self, axis):.2f}\n"
            for side in ("left", "right") for axis in ("zoom", "focus", "iris")), encoding="utf-8")


class Line:
    """A client of the daemon."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(ANSWER_S)
        self.socket.connect(str(path))
        self.file = self.socket.makefile("r", encoding="utf-8")

    def ask(self, command):
        self.socket.sendall(f"@json {command}\n".encode())
        return json.loads(self.file.readline())


def wait_for(path, process):
    end = time.monotonic() + START_S
    while not path.exists():
        if process.poll() is not None or time.monotonic() > end:
            raise RuntimeError(f"{process.args[0]} does not start")
        time.sleep(0.02)


class Programs:
    def __init__(self, build):
        build = pathlib.Path(build)
        self.simrig = build / "tools" / "simrig" / "simrig"
        self.render = build / "tools" / "simrig" / "simrig-render"
        self.daemon = build / "daemon" / "vergenced"
        self.control = SIMRIG / "control"

    def controlled(self, folder, command):
        """The rig's answer as a dictionary: `key: number` and `key: {key: number, ...}`."""
        text = subprocess.run([self.control, f"unix:{folder}/rig.sock", command], check=True,
                              capture_output=True, text=True, timeout=START_S).stdout
        answer = {}
        for key, value in re.findall(r"^(\w+): (.*)$", text, re.M):
            parts = re.findall(r"(\w+): ([-\d.e+]+)", value)
            answer[key] = {k: float(v) for k, v in parts} if value[0] == "{" else float(value)
        return answer

    def frame(self, scene, folder, focus, seed):
        subprocess.run([self.render, folder / "scene.yaml", folder / "exact.yaml", "--out",
                        folder / "x", "--camera", scene.side, "--zoom", str(scene.zoom), "--iris",
                        str(scene.iris), "--focus", str(min(max(focus, 300), 850)), "--pan", "0",
                        "--window", ",".join(map(str, scene.region)), "--exposure",
                        str(scene.exposure_us), "--gain", str(scene.gain), "--seed", str(seed)],
                       check=True, stdout=subprocess.DEVNULL)
        image = cv2.imread(str(folder / "x.pgm"), cv2.IMREAD_UNCHANGED).astype(float) - BLACK_DN
        return image[::2, ::2]

    def classify(self, scene, folder, focus):
        """textured, flat or between, by the rms of the true sharp window and a frame's noise."""
        a, b = (self.frame(scene, folder, focus, seed) for seed in (1, 2))
        noise = (a - b).std() / math.sqrt(2)
        rms = math.sqrt(max(((a - a.mean()) * (b - b.mean())).mean(), 0))
        if rms >= 3 * noise and rms >= 0.02 * a.mean():
            return "two depths" if scene.kind == "two depths" else "textured"
        return "flat" if rms < 0.5 * noise else "between"


def focused(scene, programs, folder):
    """Runs a scene; returns its row."""
    started = []

    def start(*words):
        with open(folder / "log", "ab") as log:
            started.append(subprocess.Popen([str(word) for word in words], stdout=log,
                                            stderr=log, stdin=subprocess.DEVNULL))
        return started[-1]
    scene.write(folder)
    try:
        wait_for(folder / "rig.sock", start(
            programs.simrig, "--scene", folder / "scene.yaml", "--rig", folder / "rig.yaml",
            "--seed", scene.seed, "--script", folder / "script", "--listen",
            f"unix:{folder}/rig.sock"))
        wait_for(folder / "v.sock", start(
            programs.daemon, f"backend=sim unix:{folder}/rig.sock", f"socket={folder}/v.sock",
            f"files={folder}/files", f"store={folder}/store", "confine=no"))
        line = Line(folder / "v.sock")
        for command in ("bringup", f"exposure {scene.exposure_us:.0f}", f"gain {scene.gain}"):
            answer = line.ask(command)
            if not answer["ok"]:
                raise RuntimeError(f"{command}: {answer}")
        sharp = f"sharp {scene.side} " + " ".join(map(str, scene.region))
        row = {"scene": scene, "before": programs.controlled(folder, sharp),
               "begin_s": programs.controlled(folder, "status")["time_s"]}
        row["answer"] = line.ask(f"autofocus side={scene.side} region="
                                 + ",".join(map(str, scene.region)))
        row["seconds"] = programs.controlled(folder, "status")["time_s"] - row["begin_s"]
        row["after"] = programs.controlled(folder, sharp)
        row["class"] = programs.classify(scene, folder, row["after"]["nearest"]["focus"])
        return row
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait()


def judged(row):
    """Adds what the answer is worth."""
    scene, answer, after = row["scene"], row["answer"], row["after"]
    found = (answer.get("result") or {}).get(scene.side, {})
    row["verdict"] = found.get("verdict") or next(
        (verdict for verdict in VERDICTS if verdict in json.dumps(answer)), None)
    if row["verdict"] is None:
        raise RuntimeError(f"no verdict: {answer}")
    row["frames"], row["reported_px"] = found.get("frames"), found.get("blur")
    depths = [after["nearest"]] + ([after["farthest"]] if scene.kind == "two depths" else [])
    best = min(depths, key=lambda depth: depth["blur_px"])
    row["counts"], row["px"] = after["focus"] - best["focus"], best["blur_px"]
    row["ends_sharp"] = row["px"] <= SHARP_PX or abs(row["counts"]) <= STEP_COUNTS
    # The motor does not make smaller steps: this much blur cannot be avoided.
    reachable_px = row["px"] * min(STEP_COUNTS / max(abs(row["counts"]), 1e-9), 1)
    row["false"] = row["verdict"] == "focused" and row["px"] > reachable_px + FALSE_PX
    row["missed"] = (row["class"] in ("textured", "two depths") and scene.kind not in ("lamps", "near") and
                     not (row["ends_sharp"] and row["verdict"] in VERDICTS[:2] + ("two peaks",)))
    return row


VERDICTS = ("focused", "sharp everywhere", "no contrast", "peak at end of range", "two peaks",
            "misled by lights", "scene changed", "lens jammed")


def mark_of(row):
    if row["false"]:
        return "FALSE"
    if row["missed"]:
        return "missed"
    return "" if row["ends_sharp"] else "off"


def line_of(row):
    reported = "-" if row["reported_px"] is None else f"{row['reported_px']:.1f}"
    return (f"{row['scene'].text()}  {row['class']:10s} {row['verdict']:20s} {row['counts']:+7.1f} "
            f"counts {row['px']:6.1f} px (reported {reported}) {row['frames']} frames "
            f"{row['seconds']:.1f} s {mark_of(row)}")


def share(rows, good):
    return f"{sum(map(good, rows))} of {len(rows)}" if rows else "none drawn"


def table(rows, seed):
    """Rows of a Markdown table: figure, measured, goal."""
    textured = [row for row in rows if row["class"] == "textured"]
    reported = [row for row in textured if row["verdict"] == "focused" and
            row["reported_px"] is not None]
    flat = [row for row in rows if row["class"] == "flat"]
    lines = [
        ("textured, single depth: ends within 1 px of blur or 2 counts",
         share(textured, lambda row: row["ends_sharp"]), ">= 99.9 %"),
        ("two depths: one of them is sharp", share(
            [row for row in rows if row["class"] == "two depths"],
            lambda row: row["ends_sharp"]), "-"),
        ("flat: ends in `no contrast`",
         share(flat, lambda row: row["verdict"] == "no contrast"), "all"),
        ("`focused` for what is not (2 px above the best reachable)",
         share(rows, lambda row: row["false"]), "0"),
        ("missed: textured, but neither sharp nor said to be",
         share(rows, lambda row: row["missed"]), "-"),
        ("reported blur within 30 % or 0.5 px of the true one",
         share(reported, lambda row: abs(row["reported_px"] - row["px"]) <=
               max(0.3 * row["px"], 0.5)),
         "95 %")]
    for name, key, goal in (("rig time of one lens, p50, p99", "seconds", "6, 10 s"),
                            ("frames read, p50, p99", "frames", "p99 250")):
        values = [row[key] for row in textured if row[key] is not None]
        if values:
            lines.append((name, ", ".join(f"{numpy.percentile(values, part):.1f}"
                                          for part in (50, 99)), goal))
    return [f"| {' | '.join(line)} |" for line in
            [(f"figure, {len(rows)} scenes through simrig, seed {seed}", "measured", "goal"),
             ("---",) * 3] + lines]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--scene", type=int)
    parser.add_argument("--region", type=int, default=100)
    parser.add_argument("--hard", action="store_true")
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    programs = Programs(options.build)

    def run(number):
        scene = Scene(options.seed, number, options.region, options.hard)
        if options.keep:
            options.keep.mkdir(parents=True, exist_ok=True)
        folder = pathlib.Path(tempfile.mkdtemp(prefix=f"scene{number}.", dir=options.keep))
        try:
            row = judged(focused(scene, programs, folder))
        except RuntimeError as error:
            raise SystemExit(f"{scene.text()}: {error}") from error
        finally:
            if not options.keep:
                shutil.rmtree(folder)
        if options.list:
            print(line_of(row), flush=True)
        return row
    numbers = [options.scene] if options.scene is not None else range(
        len(HARD) if options.hard else options.runs)
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        rows = list(pool.map(run, numbers))
    print("\n".join(table(rows, options.seed)))
    return 1 if any(row["false"] for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
