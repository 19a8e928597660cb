# SPDX-License-Identifier: Apache-2.0
"""Makes a table and an SVG plot from the JSON of scaling_bench.

usage: plot_scaling.py RESULT.json DRAWING.svg
"""
import json
import sys
from xml.sax.saxutils import escape

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f", "#000000")
PANEL_WIDTH, PANEL_HEIGHT, GAP_LEFT, GAP_TOP = 330, 230, 62, 52


def print_table(document):
    print("time (of the processor, 1 thread, best of the rounds) = at zero + slope x")
    for series in document["series"]:
        unit = f" ({series['unit']})" if series["unit"] else ""
        first, last = (series["methods"][0]["points"][i] for i in (0, -1))
        print(f"\n{series['pair']} along {series['along']}{unit}: {first['x']:g} to {last['x']:g}")
        print(f"  {'':28} {'at zero ms':>11} {'slope ms':>10} {'R^2':>7}   first and last ms")
        for method in series["methods"]:
            fit, points = method["fit_of_best"], method["points"]
            print(f"  {method['method']:28} {fit['at_zero_ms']:11.2f} {fit['slope_ms']:10.4f} "
                  f"{fit['r2']:7.4f}   {points[0]['best_ms']:.1f} {points[-1]['best_ms']:.1f}")


def tick_step(greatest):
    """A round step that gives three to seven ticks."""
    step = 10.0 ** (len(str(int(greatest))) - 1) if greatest >= 1 else 0.1
    for factor in (0.2, 0.5, 1, 2, 5):
        if greatest / (factor * step) <= 6:
            return factor * step
    return 10 * step


class Panel:
    """The plot of one series; x and y start at zero."""

    def __init__(self, series, colours, left, top):
        self.series, self.colours, self.left, self.top = series, colours, left, top
        points = [point for method in series["methods"] for point in method["points"]]
        self.greatest_x = 1.05 * max(point["x"] for point in points)
        self.greatest_ms = 1.05 * max(point["best_ms"] for point in points)

    def place(self, x, ms):
        return (self.left + PANEL_WIDTH * x / self.greatest_x,
                self.top + PANEL_HEIGHT * (1 - ms / self.greatest_ms))

    def axes(self):
        bottom = self.top + PANEL_HEIGHT
        yield (f'<rect x="{self.left}" y="{self.top}" width="{PANEL_WIDTH}" height="{PANEL_HEIGHT}" '
               'fill="none" stroke="#444"/>')
        title = f"{self.series['pair']}: ms along {self.series['along']}"
        if self.series["unit"]:
            title += f" ({self.series['unit']})"
        yield f'<text x="{self.left}" y="{self.top - 8}" font-weight="bold">{escape(title)}</text>'
        step, value = tick_step(self.greatest_x), 0.0
        while value <= self.greatest_x:
            x, _ = self.place(value, 0)
            yield f'<line x1="{x:.1f}" y1="{bottom}" x2="{x:.1f}" y2="{bottom + 4}" stroke="#444"/>'
            yield f'<text x="{x:.1f}" y="{bottom + 16}" text-anchor="middle">{value:g}</text>'
            value += step
        step, value = tick_step(self.greatest_ms), 0.0
        while value <= self.greatest_ms:
            _, y = self.place(0, value)
            yield (f'<line x1="{self.left - 4}" y1="{y:.1f}" x2="{self.left + PANEL_WIDTH}" '
                   f'y2="{y:.1f}" stroke="#ddd"/>')
            yield f'<text x="{self.left - 7}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>'
            value += step

    def curves(self):
        for method in self.series["methods"]:
            colour, fit = self.colours[method["method"]], method["fit_of_best"]
            last = method["points"][-1]["x"]
            # The fitted line, where it is above zero.
            first = max(0.0, -fit["at_zero_ms"] / fit["slope_ms"] if fit["slope_ms"] > 0 else 0.0)
            ends = [self.place(x, fit["at_zero_ms"] + fit["slope_ms"] * x) for x in (first, last)]
            yield (f'<line x1="{ends[0][0]:.1f}" y1="{ends[0][1]:.1f}" x2="{ends[1][0]:.1f}" '
                   f'y2="{ends[1][1]:.1f}" stroke="{colour}" stroke-dasharray="4 3"/>')
            for point in method["points"]:
                x, y = self.place(point["x"], point["best_ms"])
                yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>'

    def draw(self):
        return [*self.axes(), *self.curves()]


def drawing(document):
    names = [method["method"] for method in document["series"][0]["methods"]]
    colours = {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(names)}
    pairs = list(dict.fromkeys(series["pair"] for series in document["series"]))
    columns = {pair: 0 for pair in pairs}
    lines = []
    for series in document["series"]:
        column, row = columns[series["pair"]], pairs.index(series["pair"])
        columns[series["pair"]] += 1
        lines += Panel(series, colours, GAP_LEFT + column * (PANEL_WIDTH + GAP_LEFT),
                       GAP_TOP + row * (PANEL_HEIGHT + GAP_TOP)).draw()
    width = max(columns.values()) * (PANEL_WIDTH + GAP_LEFT) + 20
    legend = GAP_TOP + len(pairs) * (PANEL_HEIGHT + GAP_TOP)
    for i, name in enumerate(names):
        y = legend + 18 * i
        lines.append(f'<circle cx="{GAP_LEFT}" cy="{y}" r="4" fill="{colours[name]}"/>')
        lines.append(f'<text x="{GAP_LEFT + 12}" y="{y + 4}">{escape(name)}</text>')
    height = legend + 18 * len(names) + 10
    head = (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
            f'viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">')
    return "\n".join([head, '<rect width="100%" height="100%" fill="#fff"/>', *lines, "</svg>"]) + "\n"


def main():
    result, plot = sys.argv[1:]
    with open(result, encoding="utf-8") as file:
        document = json.load(file)
    print_table(document)
    with open(plot, "w", encoding="utf-8") as file:
        file.write(drawing(document))


if __name__ == "__main__":
    main()
