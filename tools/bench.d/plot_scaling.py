# SPDX-License-Identifier: Apache-2.0
"""Makes a table and an SVG plot from the JSON of scaling_bench.

usage: plot_scaling.py RESULT.json DRAWING.svg
"""
import json
import sys

import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402


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


def plot(document, path):
    """A row of panels a pair: measured points, and the fitted lines where they are above zero."""
    pairs = list(dict.fromkeys(series["pair"] for series in document["series"]))
    columns = len(document["series"]) // len(pairs)
    figure, panels = pyplot.subplots(len(pairs), columns, figsize=(4 * columns, 3.2 * len(pairs)),
                                     squeeze=False)
    for panel, series in zip(panels.flat, document["series"]):
        unit = f" ({series['unit']})" if series["unit"] else ""
        panel.set_title(f"{series['pair']}: ms along {series['along']}{unit}", fontsize=9)
        for method in series["methods"]:
            x, ms = numpy.array([(point["x"], point["best_ms"]) for point in method["points"]]).T
            (drawn,) = panel.plot(x, ms, "o", markersize=4, label=method["method"])
            line = numpy.linspace(0, x[-1], 50)
            fitted = method["fit_of_best"]["at_zero_ms"] + method["fit_of_best"]["slope_ms"] * line
            panel.plot(line, numpy.where(fitted >= 0, fitted, numpy.nan), "--", linewidth=1,
                       color=drawn.get_color())
        panel.set_xlim(0)
        panel.set_ylim(0)
    figure.tight_layout(rect=(0, 0.08, 1, 1))
    figure.legend(*panels.flat[0].get_legend_handles_labels(), loc="lower center", ncol=4,
                  fontsize=8)
    figure.savefig(path)


def main():
    result, path = sys.argv[1:]
    with open(result, encoding="utf-8") as file:
        document = json.load(file)
    print_table(document)
    plot(document, path)


if __name__ == "__main__":
    main()
