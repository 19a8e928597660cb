# SPDX-License-Identifier: Apache-2.0
"""Atomic file writing, and texts of system errors."""
import errno
import os


def output_text(error):
    """An OSError as one line that begins with the file; Python's own begins with a number."""
    if not error.strerror:
        return str(error)
    path = error.filename2 or error.filename
    return f"{os.fsdecode(path)}: {error.strerror}" if path else error.strerror


def make_directory(path):
    """Creates a directory if missing; a file in its place is reported as not being a directory."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path)) from error


def write_whole(path, data):
    """Replaces a file atomically; a link is replaced, not followed."""
    part = path.with_name(path.name + ".part")
    part.unlink(missing_ok=True)
    try:
        with open(part, "xb") as file:
            file.write(data)
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
