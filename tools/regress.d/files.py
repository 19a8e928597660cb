# SPDX-License-Identifier: Apache-2.0
"""Files that are written whole or not at all, and how errors of the system are told."""
import errno
import os


def said(error):
    """One line of an OSError, with the file first: Python's own form begins with a number."""
    if not error.strerror:
        return str(error)
    path = error.filename2 or error.filename
    return f"{os.fsdecode(path)}: {error.strerror}" if path else error.strerror


def make_directory(path):
    """Also where it is there already. A file in its place is told as what it is not."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path)) from error


def write_whole(path, data):
    """Replaces what has this name, also if it is a link, which is not followed."""
    part = path.with_name(path.name + ".part")
    part.unlink(missing_ok=True)
    try:
        with open(part, "xb") as file:
            file.write(data)
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
