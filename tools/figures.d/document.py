# SPDX-License-Identifier: Apache-2.0
"""The figures as a page of the documentation: FIGURES.md and its pictures."""
import re
import textwrap

import cv2
import numpy as np

from figure import write_whole
from figure_surfaces import FIGURES as SURFACES, METHODS

# Of the first table of a surface's figure: the rows that the page has, and its columns' heads.
SHOWN = {"visible measured": "visible measured", "of it with texture": "of it with texture",
         "after similarity: textured, median": "error after similarity: textured, median", "all, median": "of all",
         "rms": "rms, absolute", "wrong (> 3 px)": "wrong"}
PANEL_PX, GAP_PX = (300, 232), 4
QUALITY = [cv2.IMWRITE_WEBP_QUALITY, 70]


def table_of(heads, rows):
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def decoded(picture):
    return cv2.imdecode(np.frombuffer(picture.data, np.uint8), cv2.IMREAD_COLOR)


def panel(image):
    """Scaled to cover a panel, and cut to it about its middle."""
    width, height = PANEL_PX
    factor = max(width / image.shape[1], height / image.shape[0])
    image = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    top, left = (image.shape[0] - height) // 2, (image.shape[1] - width) // 2
    return cv2.copyMakeBorder(image[top:top + height, left:left + width], GAP_PX, 0, GAP_PX, 0,
                              cv2.BORDER_CONSTANT, value=(255, 255, 255))


def sheet(figures, path):
    """A row for each surface: the left half of the pair, our disparities, our surface from two sides."""
    rows = []
    for figure in figures:
        ours = [decoded(picture) for picture in figure.pictures if "Vergence" in picture.caption]
        pair = decoded(figure.pictures[0])
        rows.append(np.hstack([panel(image) for image in [pair[:, :pair.shape[1] // 2], *ours[:3]]]))
    cv2.imwrite(str(path), np.vstack(rows), QUALITY)


def surfaces(figures, folder):
    sheet(figures, folder / "surfaces.webp")
    rows, methods = [], [name for _, name in METHODS]
    for figure in figures:
        heads = figure.tables[0].heads[1:]
        found = {name: dict(zip(heads, values)) for name, *values in figure.tables[0].rows}
        rows.append([re.sub(r"^Figure \d+: the | in the picture$", "", figure.title),
                     *("; ".join(found[name].get(method, "-") for method in methods) for name in SHOWN)])
    heads = ["object", *SHOWN.values()]
    return ("## Figures 6 to 9: surfaces\n\n![pair, disparities and surfaces of each row](surfaces.webp)\n\n"
            "From left to right: the left picture, disparities (near is bright, grey was not measured), the surface "
            "from the left, and from the right and above. Each cell of the table has the values of " +
            ", ".join(methods) + "; a dash: no surface was found.\n\n" +
            table_of(heads, rows))


def section(name, figure, folder):
    """Its first table, and its pictures as files beside the page."""
    text = f"## {figure.title}\n\n{figure.text}\n\n"
    for number, picture in enumerate(figure.pictures):
        stem = f"{name}_{number}"
        if picture.svg:
            (folder / f"{stem}.svg").write_text(picture.svg, encoding="utf-8")
            text += f"![{picture.caption}]({stem}.svg)\n"
        else:
            cv2.imwrite(str(folder / f"{stem}.webp"), decoded(picture), QUALITY)
            text += f"![{picture.caption}]({stem}.webp)\n"
    return text + "".join("\n" + table_of(table.heads, table.rows) for table in figure.tables[:1])


def write(title, command, figures, folder):
    """`figures` is a table from name to Figure."""
    folder.mkdir(parents=True, exist_ok=True)
    measured = [figure for name, figure in figures.items() if name in SURFACES]
    parts = [f"# {title}\n\nMade by `{command}`.\n"]
    parts += [section(name, figure, folder) for name, figure in figures.items() if name not in SURFACES]
    parts += [surfaces(measured, folder)] if measured else []
    wrapped = ["\n".join(textwrap.wrap(line, 120, break_long_words=False, break_on_hyphens=False))
               if len(line) > 120 and line[0] not in "|!#" else line for line in "\n".join(parts).split("\n")]
    write_whole(folder / "FIGURES.md", "\n".join(wrapped))
