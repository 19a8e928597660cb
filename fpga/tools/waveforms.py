# SPDX-License-Identifier: Apache-2.0
"""Draws the waveforms of fpga/README.md from a simulation of the bridge (fpga/figures)."""
import argparse
import glob
import os
import re
import subprocess
import sys
import tempfile

from places import FPGA

FIGURES = os.path.join(FPGA, "figures")
SCENES = {  # file: number in the bench, signals and their names in the picture, groups of rows
    "sensor_transfer.svg": (0, [("scl", "DSP SCL"), ("sda", "DSP SDA"), ("", ""),
                                ("left_scl", "left SCL"), ("left_sda", "left SDA"), ("", ""),
                                ("right_scl", "right SCL"), ("right_sda", "right SDA")]),
    "camera_switch.svg": (1, [("left_fv", "left FRAME_VALID"), ("right_fv", "right FRAME_VALID"),
                              ("", ""), ("ppi_clk", "PPI_CLK"), ("ppi_fs1", "PPI_FS1, line"),
                              ("ppi_fs2", "PPI_FS2, frame"), ("irq", "irq: switched")])}
LEFT, WIDTH, ROW, HIGH = 150, 1000, 26, 16


def simulate(scene):
    """Runs the bench; returns {signal: [(ns, level), ...]} of its own one-bit signals."""
    with tempfile.TemporaryDirectory(prefix="waveforms-") as folder:
        image, dump = os.path.join(folder, "bench"), os.path.join(folder, "dump.vcd")
        files = [path for name in ("rtl", "generated")
                 for path in sorted(glob.glob(os.path.join(FPGA, name, "*.v")))]
        subprocess.run(["iverilog", "-g2005", f"-I{FPGA}/generated", "-s", "waveform_bench",
                        f"-Pwaveform_bench.SCENE={scene}", "-o", image,
                        os.path.join(FIGURES, "waveform_bench.v"), *files], check=True)
        subprocess.run(["vvp", "-n", image], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        with open(dump, encoding="ascii") as file:
            header, body = file.read().split("$enddefinitions $end", 1)
    names = {}
    for code, name in re.findall(r"\$var \w+ 1 (\S+) (\w+) \$end", header):
        names.setdefault(code, []).append(name)
    waves, now = {}, 0.0
    for word in body.split():
        if word[0] == "#":
            now = int(word[1:]) / 1000  # the bench's time resolution is 1 ps
        elif word[0] in "01xz" and word[1:] in names:
            for name in names[word[1:]]:
                waves.setdefault(name, []).append((now, word[0] == "1"))
    return waves


def window(waves):
    begin, = [when for when, level in waves["shown"] if level]
    return begin, [when for when, level in waves["shown"] if not level and when > begin][0]


def path(wave, begin, end, top):
    """The line of one signal."""
    def at(when):
        return f"{LEFT + (when - begin) / (end - begin) * WIDTH:.1f}"

    def height(level):
        return top + (0 if level else HIGH)

    level = [value for when, value in wave if when <= begin][-1]
    words = [f"M{at(begin)} {height(level)}"]
    for when, value in wave:
        if begin < when < end and value != level:
            level = value
            words.append(f"H{at(when)}V{height(level)}")
    return "".join([*words, f"H{at(end)}"])


def draw(waves, rows):
    begin, end = window(waves)
    lines, top = [], 10
    for signal, name in rows:
        if not signal:
            top += ROW // 2
            continue
        lines += [f'<text x="{LEFT - 10}" y="{top + HIGH - 3}" text-anchor="end">{name}</text>',
                  f'<path d="{path(waves[signal], begin, end, top)}"/>']
        top += ROW
    step = 1000 if end - begin < 15000 else 5000
    for when in range(0, int(end - begin) + 1, step):
        x = LEFT + when / (end - begin) * WIDTH
        lines += [f'<path class="grid" d="M{x:.1f} 6V{top}"/>',
                  f'<text x="{x:.1f}" y="{top + 14}" text-anchor="middle">{when // 1000} us</text>']
    return "\n".join([
        "<!-- SPDX-License-Identifier: Apache-2.0. Made by fpga/tools/waveforms.py -->",
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {LEFT + WIDTH + 20} {top + 22}" '
        'font-family="sans-serif" font-size="12">',
        "<style>path{fill:none;stroke:#124}.grid{stroke:#ccc}text{fill:#222}</style>",
        '<rect width="100%" height="100%" fill="#fff"/>', *lines, "</svg>"]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true",
                        help="only check whether the drawings are up to date")
    options = parser.parse_args()
    stale = []
    for name, (scene, rows) in SCENES.items():
        text = draw(simulate(scene), rows)
        file = os.path.join(FIGURES, name)
        if options.check:
            with open(file, encoding="utf-8") as known:
                if known.read() != text:
                    stale.append(name)
            continue
        with open(file, "w", encoding="utf-8") as picture:
            picture.write(text)
    for name in stale:
        print(f"waveforms.py: fpga/figures/{name} is stale: run fpga/tools/waveforms.py",
              file=sys.stderr)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
