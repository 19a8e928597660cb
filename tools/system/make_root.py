# SPDX-License-Identifier: Apache-2.0
"""usage: make_root.py --overlay DIR --busybox FILE --terminfo DIR --out FILE PROGRAM... [MODULE.ko...]

Writes the root file system as the kernel unpacks it: a cpio archive, compressed with xz. All files
belong to root; the same input gives the same bytes. Prints the archive's size before compression.
"""
import argparse
import lzma
import os
import pathlib
import stat

FOLDERS = ("bin", "dev", "lib/modules", "lib/terminfo", "proc", "root", "run", "sbin", "sys", "tmp",
           "usr/bin", "usr/sbin", "var/lib/vergence")
TERMINALS = ("l/linux", "v/vt100")
CONSOLE = (5, 1)


class Archive:
    """A cpio archive of the format "newc"."""

    def __init__(self, time):
        self.time = time
        self.members = {}

    def add(self, name, mode, data=b"", device=(0, 0)):
        parent = os.path.dirname(name)
        if parent and parent not in self.members:
            self.add(parent, stat.S_IFDIR | 0o755)
        self.members[name] = (mode, data, device)

    def add_file(self, name, path):
        executable = os.access(path, os.X_OK)
        self.add(name, stat.S_IFREG | (0o755 if executable else 0o644), path.read_bytes())

    def bytes(self):
        parts = []
        members = [(name, *self.members[name]) for name in sorted(self.members)]
        for number, (name, mode, data, device) in enumerate([*members, ("TRAILER!!!", 0, b"", (0, 0))]):
            fields = (number, mode, 0, 0, 1, self.time, len(data), 0, 0, *device, len(name) + 1, 0)
            header = b"070701" + b"".join(b"%08X" % field for field in fields) + name.encode() + b"\0"
            for part in (header, data):
                parts.append(part + bytes(-len(part) % 4))
        return b"".join(parts)


def build(arguments):
    archive = Archive(int(os.environ["SOURCE_DATE_EPOCH"]))
    for folder in FOLDERS:
        archive.add(folder, stat.S_IFDIR | (0o1777 if folder == "tmp" else 0o755))
    archive.add("dev/console", stat.S_IFCHR | 0o600, device=CONSOLE)
    for path in sorted(arguments.overlay.rglob("*")):
        if path.is_file():
            archive.add_file(str(path.relative_to(arguments.overlay)), path)
    archive.add_file("bin/busybox", arguments.busybox)
    archive.add("bin/sh", stat.S_IFLNK | 0o777, b"busybox")
    for terminal in TERMINALS:
        archive.add_file(f"lib/terminfo/{terminal}", arguments.terminfo / terminal)
    for path in arguments.files:
        archive.add_file(("lib/modules/" if path.suffix == ".ko" else "bin/") + path.name, path)
    return archive.bytes()


def main():
    parser = argparse.ArgumentParser()
    for option in ("overlay", "busybox", "terminfo", "out"):
        parser.add_argument(f"--{option}", type=pathlib.Path, required=True)
    parser.add_argument("files", type=pathlib.Path, nargs="+")
    arguments = parser.parse_args()
    data = build(arguments)
    # The kernel's decoder knows no other check. The programs are Thumb code, of 2 bytes an instruction: a
    # literal's place in it (lp) makes 1.3 % less.
    filters = [{"id": lzma.FILTER_ARMTHUMB},
               {"id": lzma.FILTER_LZMA2, "preset": 9 | lzma.PRESET_EXTREME, "dict_size": 4 << 20, "lp": 1}]
    arguments.out.write_bytes(lzma.compress(data, check=lzma.CHECK_CRC32, filters=filters))
    print(len(data))


if __name__ == "__main__":
    main()
