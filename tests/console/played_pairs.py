# SPDX-License-Identifier: Apache-2.0
"""A daemon with two cameras that replay a recorded session's frames, so that no rig is needed; also
reading and writing a session's index."""
import os
import re
import shutil
import tempfile
import zlib

from daemon_process import DaemonTest

SESSION = os.path.join(os.environ["VERGENCE_SESSIONS"], "cylinder_1x")


def framed(lines):
    """Writes an index of these events, each line with its CRC."""
    text = b""
    for line in lines:
        text += line.encode() + b" "
        text += b"%08x\n" % zlib.crc32(text[:-1])
    return text


def lines_of(folder):
    with open(os.path.join(folder, "session.index"), encoding="ascii") as file:
        return [line.rsplit(" ", 1)[0] for line in file.read().splitlines()]


def write_index(folder, lines):
    with open(os.path.join(folder, "session.index"), "wb") as file:
        file.write(framed(lines))


class PlayedPairs(DaemonTest):
    """A daemon with two cameras that replay recorded pairs, with the same scene repeated."""
    settings = ("profile=two-cameras", "rig.width=672px", "rig.height=400px",
                "rig.skew_limit=5s")

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="console")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.path = os.path.join(cls.folder, "v.sock")
        cls.files = os.path.join(cls.folder, "files")
        cls.pairs = os.path.join(cls.folder, "pairs")
        cls.make_pairs()
        cls.start()

    @classmethod
    def make_pairs(cls):
        """Creates many pairs without calls, from two cameras, with the frames of the recorded
        session."""
        shutil.copytree(SESSION, cls.pairs, ignore=shutil.ignore_patterns("regress", "calls.log"))
        lines = lines_of(cls.pairs)
        pair = next(line for line in lines if line.startswith("pair "))
        pair = re.sub(r"_(before|after)=\S+", r"_\1=0,none,none,none", pair)
        pair = re.sub(r" (left|right)_window=\S+", "", pair)
        pairs = []
        for i in range(40):
            for side, begin_us in (("left", 20000 * i), ("right", 20000 * i + 1000)):
                pair = re.sub(rf"{side}_begin_us=\d+ {side}_end_us=\d+",
                              f"{side}_begin_us={begin_us} {side}_end_us={begin_us + 9855}", pair)
            pairs.append(pair)
        begin = lines[0].replace("profile=rig", "profile=two-cameras")
        write_index(cls.pairs, [begin, *pairs, "end"])

    @classmethod
    def arguments(cls):
        return [f"backend=replay {cls.pairs}", f"socket={cls.path}", f"files={cls.files}",
                "store=none", *cls.settings]

    @classmethod
    def record(cls, name, commands, stop=True):
        done = cls.vergence("--keep-going", input="\n".join(
            [f"record start {name}", *commands, *(["record stop"] if stop else [])]) + "\n")
        assert done.returncode == 0, done.stderr

    def setUp(self):
        self.first = self.client()
