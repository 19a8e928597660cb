# SPDX-License-Identifier: Apache-2.0
"""usage: whole.py [WIDTH HEIGHT]

A surface of the whole sensor, 2048 x 1536, by the firmware in the Blackfin simulator: its frames and its rows are
those of vergenced in front of the same rig, and all its memory at most 48 MB. Prints a table."""
import base64
import math
import pathlib
import re
import sys
import tempfile
import time
import zlib

from bf537_board import ROOT, Board, output_of, require_tool_chain
from chain_test import RIG, run_daemon

CORE_HZ = 600e6
SILENCE_S = 6 * 3600  # the matcher looks at all of the pictures before it reports
MOST_BYTES = 48e6
SIZE = tuple(map(int, sys.argv[1:])) or (2048, 1536)
AIM = ("pan 3.97 right=-3.97", "window 160 120", "autoexpose", f"window {SIZE[0]} {SIZE[1]}")
SEARCH = "near=1500 far=2500"
SURFACE = "surface-pair-1/surface.compact"
BLOCK_BYTES = 3072
BAND_PIXELS, CHUNKS = 32768, 10  # see daemon/surface.md


def chunk_of(data):
    return len(data).to_bytes(4, "little") + data


def stored_rows(compact):
    """The rows of a compact surface as they are without zlib."""
    width, height = map(int, re.search(rb"\nplan_size_px (\d+) (\d+)\n", compact).groups())
    at = compact.index(b"\nrows\n") + len(b"\nrows\n")
    parts = []
    for _ in range(CHUNKS * math.ceil(height / (BAND_PIXELS // width))):
        end = at + 4 + int.from_bytes(compact[at:at + 4], "little")
        data = zlib.decompress(compact[at + 4:end])
        length = len(data).to_bytes(2, "little")
        inverse = (0xFFFF - len(data)).to_bytes(2, "little")
        parts.append(chunk_of(b"\x18\x19\x01" + length + inverse + data + zlib.adler32(data).to_bytes(4, "big")))
        at = end
    if at + 4 != len(compact):
        sys.exit("whole: what follows the rows is not the CRC")
    return b"".join(parts)


def ask(board, line):
    start = time.monotonic()
    answer = board.type(line)
    print(f"{time.monotonic() - start:7.0f} s  {line}", flush=True)
    if "\nOK\n" not in answer:
        sys.exit(f"whole: {line}: {answer}")
    return answer


def value_of(answer, name):
    return re.search(rf"\b{name}:? +([^\s,]+)", answer)[1]


def fetch(board, offset):
    return base64.b64decode(value_of(ask(board, f"fetch {SURFACE} offset={offset} bytes={BLOCK_BYTES}"), "data"))


def measure(board, folder):
    """The reply of reconstruct, CRCs of the frames, the surface's head and its last bytes."""
    board.wait_prompt()
    ask(board, "bringup")
    sent = board.client("send", "perfect.zoom", cwd=folder)
    if sent.returncode != 0:
        sys.exit(f"whole: send: {sent.stderr}")
    for line in ("calibration set perfect.zoom", *AIM, "capture"):
        ask(board, line)
    reply = ask(board, f"reconstruct {SEARCH}")
    size = int(value_of(ask(board, "files surface-pair-1"), "size"))
    # The last part is in memory; the first one is made again.
    tail = fetch(board, size - 4)
    head = b""
    while b"\nrows\n" not in head:
        head += fetch(board, len(head))
    frames = {value_of(ask(board, f"fetch pair-1/{name}.pgm"), "crc") for name in ("left", "right")}
    return reply, frames, head[:head.index(b"\nrows\n") + len(b"\nrows\n")], tail


def compare(folder, frames, head, tail):
    calibration = head[head.index(b"\n", head.index(b"\ncalibration ") + 1) + 1:-len(b"rows\n")]
    (folder / "files").mkdir()
    (folder / "files/state.txt").write_bytes(calibration)
    answers = run_daemon(["bringup", *AIM, "calibration set state.txt", "capture session",
                          f"reconstruct preset=board {SEARCH}"], folder)
    if answers.count("OK\n") != len(AIM) + 4:
        sys.exit(f"whole: vergenced: {answers}")
    theirs = {f"{zlib.crc32(path.read_bytes()):08X}" for path in (folder / "files/session").glob("frame-*")}
    if frames != theirs:
        sys.exit(f"whole: the frames are not vergenced's: {frames} {theirs}")
    compact, = (folder / "files").glob("surface-session*/surface.compact")
    rows = stored_rows(compact.read_bytes())
    if zlib.crc32(head + rows).to_bytes(4, "little") != tail:
        sys.exit("whole: the surface is not vergenced's")


def main():
    require_tool_chain()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "perfect.zoom").write_bytes((ROOT / "tests/bf537/perfect.zoom").read_bytes())
        board = Board(RIG)
        board.silence_s = SILENCE_S
        try:
            found = measure(board, folder)
        finally:
            board.close()
        compare(folder, *found[1:])
    reply = found[0]
    symbols = output_of(pathlib.Path(output_of(ROOT / "tools/bfin-toolchain", "--where")) / "bin/bfin-elf-nm",
                        Board.image)
    program = int(re.search(r"(?m)^(\w+) \w __?bf537_pool_begin$", symbols)[1], 16)
    frames = 2 * 2 * SIZE[0] * SIZE[1]
    working = int(value_of(reply, "memory"))
    seconds = float(value_of(reply, "time"))
    total = program + frames + working
    print(f"\n{value_of(reply, 'width')} x {value_of(reply, 'height')} pixels, {value_of(reply, 'points')} points, "
          f"{SEARCH}; frames and surface are vergenced's\n"
          f"{seconds * CORE_HZ / 1e6:.0f} million cycles, {seconds:.1f} s at {CORE_HZ / 1e6:.0f} MHz\n"
          f"{total / 1e6:.1f} MB: program {program / 1e6:.1f}, frames {frames / 1e6:.1f}, "
          f"surface {working / 1e6:.1f}")
    if total > MOST_BYTES:
        sys.exit(f"whole: more than {MOST_BYTES / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
