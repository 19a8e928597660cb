# SPDX-License-Identifier: Apache-2.0
"""Writes a session directory as described in daemon/session/session.md."""
import urllib.parse
import zlib


class Session:
    """A session under construction; frames of 8 bits, or of 10 in words of 16."""

    def __init__(self, path, profile="two-cameras", instrument=None):
        path.mkdir()
        self.path, self.index, self.pairs = path, b"", 0
        self.line(f"begin version={6 if instrument else 1} build=test profile={profile} "
                  "date=2026-11-22T00:00:00Z")
        if instrument:
            self.line(f"instrument {instrument}")

    def line(self, text):
        self.index += text.encode() + b" "
        self.index += b"%08x\n" % zlib.crc32(self.index[:-1])
        (self.path / "session.index").write_bytes(self.index)

    def file(self, name, data):
        crc = f"{zlib.crc32(data):08x}"
        (self.path / name.format(crc)).write_bytes(data)
        return crc

    def calibration(self, text):
        self.line("calibration file=" + self.file("calibration-{}.txt", text))

    def zoom_calibration(self, text):
        """The calibration of all zooms is in force from here on."""
        self.line("zoom_calibration file=" + self.file("zoom-{}.txt", text))

    def pair(self, *images, layout="grey", size=None, axes=None, window=None):
        """`size`: the size stated in the index instead of the true one. `axes`: of each side, as in
        the index; `window`: of both sensors."""
        self.pairs += 1
        words = [f"pair number={self.pairs} skew_us=100 checked=no change_permille=0"]
        for side, image in zip(("left", "right"), images):
            height, width = image.shape[:2]
            kind, layout = ("P6", "rgb") if image.ndim == 3 else ("P5", layout)
            bits = 10 if image.dtype.itemsize == 2 else 8
            head = f"{kind}\n{width} {height}\n{2 ** bits - 1}\n".encode()
            data = image.astype(image.dtype.newbyteorder(">")).tobytes()
            crc = self.file("frame-{}.pnm", head + data)
            at = axes[side == "right"] if axes else "0,none,none,none"
            values = {"frame": crc, "size": size or f"{width}x{height}", "bits": bits, "layout": layout,
                      "sequence": self.pairs, "begin_us": 1000 * self.pairs,
                      "end_us": 1000 * self.pairs + 30, "exposure_us": 0, "gain_q3": 0,
                      "before": at, "after": at}
            if window:
                values["window"] = window
            words += [f"{side}_{key}={value}" for key, value in values.items()]
        self.line(" ".join(words))

    def end(self):
        self.line("end")

    def note(self, text):
        """A comment to the console, as `measure` leaves them."""
        self.line("command text=" + urllib.parse.quote(text, safe="!#$&'()*+,/:;<=>?@[]"))


def add_notes(path, *texts):
    """To a session that has ended, which is closed again."""
    session = Session.__new__(Session)
    session.path = path
    session.index = (path / "session.index").read_bytes().rsplit(b"end ", 1)[0]
    for text in texts:
        session.note(text)
    session.end()
