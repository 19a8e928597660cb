# SPDX-License-Identifier: Apache-2.0
"""Many pairs, on this machine or on those of a Dask cluster."""
from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from ._calibration import Calibration
from ._errors import ArgumentError, Error
from ._surface import reconstruct
from ._words import PathLike

_INDEX = "session.index"


@dataclass(frozen=True)
class Row:
    """What became of a pair. `result` is the directory with its files, None if there are none; `error` says why
    then. Depth and sigma are medians in mm, None where the result is not metric."""

    session: str
    pair: int
    result: Optional[str]
    error: Optional[str] = None
    points: int = 0
    depth_mm: Optional[float] = None
    sigma_mm: Optional[float] = None
    notes: int = 0
    seconds: float = 0

    def __str__(self) -> str:
        name = f"{os.path.basename(self.session)}:{self.pair}"
        if self.error is not None:
            return f"{name}  {self.error}"
        depth, sigma = ("-" if value is None else f"{value:.4g}" for value in (self.depth_mm, self.sigma_mm))
        return f"{name}  {self.points} points  {depth} mm  sigma {sigma} mm  {self.seconds:.1f} s"


def _sessions(path: str) -> Iterator[tuple[str, str]]:
    """(session, directory of its results below the output directory)."""
    if os.path.isfile(os.path.join(path, _INDEX)):
        yield path, ""
        return
    names = sorted(os.listdir(path)) if os.path.isdir(path) else []
    found = [name for name in names if os.path.isfile(os.path.join(path, name, _INDEX))]
    if not found:
        raise ArgumentError("ARGUMENT", f"{path}: neither a session nor a directory of sessions")
    for name in found:
        yield os.path.join(path, name), name


def _pairs(session: str) -> int:
    with open(os.path.join(session, _INDEX), "rb") as index:
        return sum(line.startswith(b"pair ") for line in index)


def _median(values: np.ndarray) -> Optional[float]:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else None


def _measure(session: str, pair: int, out: str, path: Optional[str], text: Optional[str],
             files: Optional[list[str]], options: dict[str, Any]) -> Row:
    """One task, with the calibration in the file `path` or in `text`. Its files appear whole or not at all,
    so that it can be done twice."""
    begin = time.monotonic()
    try:
        calibration = path if text is None else Calibration.parse(text)
        surface = reconstruct(session, None, calibration, pair=pair, progress=False, **options)
        surface.write(out, files=files, progress=False)
    except Error as error:
        return Row(session, pair, None, str(error))
    metric = surface.metric
    return Row(session, pair, out, None, len(surface.points_mm), _median(surface.depth_mm) if metric else None,
               _median(surface.sigma_mm) if metric and options.get("refine", True) else None, len(surface.notes),
               time.monotonic() - begin)


def _distribute(tasks: list[tuple[Any, ...]], scheduler: str) -> Iterator[Row]:
    try:
        from distributed import Client, as_completed
        from distributed.comm import get_address_host_port
    except ImportError:
        raise Error("MISSING", "scheduler requires the package distributed: pip install distributed") from None
    try:
        # A Client without a scheduler waits for 30 s, and 60 s more when it is removed.
        socket.create_connection(get_address_host_port(scheduler), 10).close()
        client = Client(scheduler, set_as_default=False)
    except (OSError, ValueError) as error:
        raise Error("IO", f"{scheduler}: no scheduler answers: {error}") from None
    futures = []
    try:
        futures = [client.submit(_measure, *task, pure=False) for task in tasks]
        places = {future.key: task for future, task in zip(futures, tasks)}
        for future in as_completed(futures, loop=client.loop):
            if future.status == "finished":
                yield future.result()
            else:  # the cluster gave up, or the package is missing there
                yield Row(*places[future.key][:2], None, str(future.exception()))
    finally:
        client.cancel(futures)
        client.close()


def batch(paths: Union[PathLike, list[PathLike]], out: PathLike,
          calibration: Union[None, Calibration, PathLike] = None, *, scheduler: Optional[str] = None,
          files: Optional[list[str]] = None, progress: Optional[Callable[[Row], None]] = None,
          **options: Any) -> list[Row]:
    """Measures every pair of recorded sessions, and returns a row for each, in order.

    paths: a session, a directory of sessions, or a list of them. out: pair 3 of `scene` goes to out/0003, or to
    out/scene/0003 from a directory or list. calibration: a file's name, or loaded; None: the sessions' own. files:
    only these. progress: called with each row as it is made. options: those of `reconstruct`.

    scheduler: the address of a Dask scheduler, "tcp://host:8786": each pair is a task with one thread, and
    tasks of a lost worker are done again. The workers need this package and see `paths`, `out` and the
    calibration's file under the same names. Without it the pairs are measured here, one after the other.

    A pair that cannot be measured is a row with an `error` and does not stop the others."""
    many = isinstance(paths, (list, tuple))
    target = os.path.abspath(os.fspath(out))
    loaded = isinstance(calibration, Calibration)
    text = calibration.text if loaded else None
    file = None if loaded or calibration is None else os.path.abspath(os.fspath(calibration))
    if scheduler is not None:
        options = {"threads": 1, **options}
    tasks: list[tuple[Any, ...]] = []
    for path in paths if many else [paths]:
        for session, name in _sessions(os.path.abspath(os.fspath(path))):
            label = name or (os.path.basename(session) if many else "")
            for pair in range(1, _pairs(session) + 1):
                tasks.append((session, pair, os.path.join(target, label, f"{pair:04}"), file, text, files, options))
    places = [task[2] for task in tasks]
    if len(set(places)) < len(places):
        raise ArgumentError("ARGUMENT", "two sessions have the same name: measure them one by one")
    rows: dict[tuple[str, int], Row] = {}
    for row in _distribute(tasks, scheduler) if scheduler is not None else (_measure(*task) for task in tasks):
        rows[row.session, row.pair] = row
        if progress is not None:
            progress(row)
    return [rows[task[0], task[1]] for task in tasks]
