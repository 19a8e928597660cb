# SPDX-License-Identifier: Apache-2.0
"""What a figure of tools/figures is, and the page that shows them.

A module figure_*.py of this folder has FIGURES, a table from the name of each of its figures to a
function of a Context that returns a Figure; tools/figures finds it there.
"""
import argparse
import base64
import dataclasses
import html
import io
import os
import pathlib
import re
import threading

# The texts of all plots share one parser, which draws for one thread at a time.
DRAWING = threading.Lock()
PAGE = pathlib.Path(__file__).resolve().parents[1] / "host" / "page"
STYLE = """
.shots { display: grid; gap: 14px; grid-template-columns: repeat(auto-fit, minmax(min(100%, 300px), 1fr)); margin: 12px 0; align-items: start; }
.shots svg { width: 100%; height: auto; background: #fff; }
pre { overflow-x: auto; background: var(--panel); border: 1px solid var(--line); border-radius: 8px; padding: 9px 14px; font-size: 0.84rem; }
"""


class Options(argparse.ArgumentParser):
    """With what figures and experiments have in common; a mistake is one line."""

    def __init__(self, program):
        super().__init__(prog=program, add_help=False, allow_abbrev=False)
        self.add_argument("--only", type=self.expression, default=re.compile(".*"))
        self.add_argument("--quick", action="store_true")
        self.add_argument("--seed", type=self.count, default=1)
        self.add_argument("--jobs", type=self.count, default=os.cpu_count() or 1)
        self.add_argument("--help", action="store_true")

    @staticmethod
    def expression(text):
        try:
            return re.compile(text)
        except re.error as error:
            raise argparse.ArgumentTypeError(f"not a regular expression ({error})") from error

    @staticmethod
    def count(text):
        if not text.isdecimal() or int(text) < 1:
            raise argparse.ArgumentTypeError("not a positive whole number")
        return int(text)

    def error(self, message):
        self.exit(2, f"{self.prog}: {message}; see --help\n")


def write_whole(path, text):
    """Writes a file that a later run relies on: whole, or not at all."""
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


@dataclasses.dataclass
class Context:
    """What a figure may use. `folder` is its own and stays from run to run: a figure that finds there what
    it has measured before, with the same command and seed, need not measure it again."""
    programs: pathlib.Path   # the build: tools/vergence, daemon/vergenced, tools/simrig/simrig-render
    calibration: pathlib.Path  # the result directory of `vergence calibrate` for the rig "default"
    folder: pathlib.Path
    seed: int
    threads: int
    quick: bool = False      # one look and one zoom, no search of the focus

    def measurement(self, words):
        """The words of a `measure`."""
        return f"{words} --quick" if self.quick else words

    def program(self, name):
        return self.programs / {"vergenced": "daemon/vergenced", "vergence": "tools/vergence"}.get(
            name, f"tools/simrig/{name}")

    @staticmethod
    def progress(text):
        print(f"   {text}", flush=True)


@dataclasses.dataclass
class Table:
    heads: list   # of the columns; the first one heads the names of the rows
    rows: list    # of lists of texts, as long as `heads`
    title: str = ""


@dataclasses.dataclass
class Picture:
    """A PNG or JPEG, or the text of an SVG."""
    caption: str
    data: bytes = b""
    svg: str = ""


@dataclasses.dataclass
class Figure:
    title: str      # "Figure 6: the cylinder, 360 mm wide"
    text: str       # a sentence or two: what is to be seen
    command: str    # that a reader can give
    seed: int
    tables: list = dataclasses.field(default_factory=list)
    pictures: list = dataclasses.field(default_factory=list)


def pyplot():
    import matplotlib
    matplotlib.use("svg")
    from matplotlib import pyplot as found
    return found


def svg_of(figure):
    text = io.StringIO()
    with DRAWING:
        figure.savefig(text, format="svg")
        pyplot().close(figure)
    return text.getvalue()[text.getvalue().index("<svg"):]


def picture_html(picture):
    if picture.svg:
        shown = picture.svg
    else:
        kind = "png" if picture.data.startswith(b"\x89PNG") else "jpeg"
        text = base64.b64encode(picture.data).decode("ascii")
        shown = f'<img alt="{html.escape(picture.caption)}" src="data:image/{kind};base64,{text}">'
    return f'<figure><div class="frame">{shown}</div><figcaption>{html.escape(picture.caption)}</figcaption></figure>\n'


def table_html(table):
    title = f"<h3>{html.escape(table.title)}</h3>" if table.title else ""
    head = "".join(f"<th>{html.escape(text)}</th>" for text in table.heads)
    rows = "".join(f'<tr><th scope="row">{html.escape(name)}</th>' +
                   "".join(f"<td>{html.escape(text)}</td>" for text in cells) + "</tr>\n"
                   for name, *cells in table.rows)
    return f'<div class="panel">{title}<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>\n'


def section(name, figure):
    pictures = "".join(map(picture_html, figure.pictures))
    return (f'<section id="{name}"><h2>{html.escape(figure.title)}</h2>'
            f'<p class="lead">{html.escape(figure.text)}</p>'
            f'<pre>{html.escape(figure.command)}    # seed {figure.seed}</pre>'
            f'<div class="shots">{pictures}</div>' + "".join(map(table_html, figure.tables)) + "</section>\n")


def page(title, meta, figures):
    """One self-contained page; `figures` is a table from name to Figure."""
    parts = {"title": title, "images": "data:", "style": (PAGE / "page.css").read_text(encoding="utf-8") + STYLE,
             "meta": f'<p class="meta">{html.escape(meta)}</p>',
             "body": "".join(section(name, figure) for name, figure in figures.items()),
             "footer": "Made by tools/figures.", "after": "",
             "script": (PAGE / "page.js").read_text(encoding="utf-8")}
    text = (PAGE / "page.html").read_text(encoding="utf-8")
    for name, content in parts.items():
        text = text.replace("{{" + name + "}}", content)
    return text
