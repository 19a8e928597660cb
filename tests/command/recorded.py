# SPDX-License-Identifier: Apache-2.0
"""Writes a session directory as described in daemon/session/session.md."""
import zlib


class Session:
    """A session under construction; frames of 8 bits."""

    def __init__(self, path):
        path.mkdir()
        self.path, self.index, self.pairs = path, b"", 0
        self.line("begin version=1 build=test profile=two-cameras date=2026-11-22T00:00:00Z")

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

    def pair(self, *images, layout="grey", size=None):
        """`size`: the size stated in the index instead of the true one."""
        self.pairs += 1
        words = [f"pair number={self.pairs} skew_us=100 checked=no change_permille=0"]
        for side, image in zip(("left", "right"), images):
            height, width = image.shape[:2]
            kind, layout = ("P6", "rgb") if image.ndim == 3 else ("P5", layout)
            head = f"{kind}\n{width} {height}\n255\n".encode()
            crc = self.file("frame-{}.pnm", head + image.tobytes())
            axes = "0,none,none,none"
            values = {"frame": crc, "size": size or f"{width}x{height}", "bits": 8, "layout": layout,
                      "sequence": self.pairs, "begin_us": 1000 * self.pairs,
                      "end_us": 1000 * self.pairs + 30, "exposure_us": 0, "gain_q3": 0,
                      "before": axes, "after": axes}
            words += [f"{side}_{key}={value}" for key, value in values.items()]
        self.line(" ".join(words))

    def end(self):
        self.line("end")
