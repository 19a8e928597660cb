# SPDX-License-Identifier: Apache-2.0
"""The exceptions of the package."""


class Error(Exception):
    """What the program `vergence` would print, in the same words. `code` is the name of the error, such
    as "SIZE_MISMATCH" (the list: firmware/core/error.h)."""

    def __init__(self, code: str, text: str) -> None:
        super().__init__(text)
        self.code = code


class ArgumentError(Error, ValueError):
    """An argument, an array or a combination of arguments cannot be used."""


class NoSurfaceError(Error):
    """The inputs are in order, but nothing could be measured; the text says why."""


_CLASSES = {"ARGUMENT": ArgumentError, "RANGE": ArgumentError, "NO_SURFACE": NoSurfaceError}


def fail(code: str, text: str) -> None:
    """Raises the exception for an error of the library."""
    raise _CLASSES.get(code, Error)(code, text)
