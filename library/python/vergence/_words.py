# SPDX-License-Identifier: Apache-2.0
"""Arguments of Python functions as words of the command line, and progress bars."""
from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Any, Optional, Union

from ._errors import ArgumentError

PathLike = Union[str, "os.PathLike[str]"]
# None: a bar where tqdm is installed and standard error is a terminal. A callable gets the stage and the
# share of the whole that is done, 0 to 1.
Progress = Union[None, bool, Callable[[str, float], None]]


def path_of(name: str, path: PathLike) -> str:
    """`name`: the argument's, for errors."""
    try:
        return os.fsdecode(path)
    except TypeError:
        raise ArgumentError("ARGUMENT", f"{name} is {path!r} (expected the name of a file)") from None


def operand_of(name: str, path: PathLike) -> str:
    """A path among options."""
    text = path_of(name, path)
    return os.path.abspath(text) if text.startswith("-") else text


def plain(value: Any) -> Any:
    """Numbers and arrays of numpy as those of Python, whose text the command line reads."""
    return value.tolist() if hasattr(value, "tolist") else value


def text_of(value: Any, separator: str) -> str:
    value = plain(value)
    if isinstance(value, (tuple, list)):
        return separator.join(text_of(one, separator) for one in value)
    if isinstance(value, float):
        return repr(value)
    return str(value)


def words_of(separators: dict[str, str], **options: Any) -> list[str]:
    """Options by the names of the command line, with _ for -: None and False are left out."""
    words: list[str] = []
    for name, value in options.items():
        option, value = "--" + name.replace("_", "-"), plain(value)
        if value is True:
            words.append(option)
        elif value is not None and value is not False:
            words += [option, text_of(value, separators.get(name, ","))]
    return words


class Bar:
    """The progress of one call, as a context manager; `call` is what the library calls, or None."""

    def __init__(self, progress: Progress) -> None:
        self.call: Optional[Callable[[str, float], None]] = None
        self._bar: Any = None
        if callable(progress):
            self.call = progress
            return
        if progress not in (None, True, False):
            raise ArgumentError("ARGUMENT", f"progress is {progress!r} (expected a function, True, False or None)")
        if progress is False or (progress is None and not sys.stderr.isatty()):
            return
        try:
            from tqdm import tqdm
        except ImportError:
            return
        self._bar = tqdm(total=100, leave=False, bar_format="{desc:12} {percentage:3.0f} % |{bar}| {elapsed}")
        self.call = self._show

    def _show(self, stage: str, share: float) -> None:
        self._bar.set_description_str(stage, refresh=False)
        self._bar.update(max(0.0, round(100 * share) - self._bar.n))

    def __enter__(self) -> "Bar":
        return self

    def __exit__(self, *_: Any) -> None:
        if self._bar is not None:
            self._bar.close()
