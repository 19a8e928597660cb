# SPDX-License-Identifier: Apache-2.0
"""Many pairs, on this machine or on those of a Dask cluster."""
from __future__ import annotations

import inspect
import math
import os
import shutil
import socket
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Optional, Union

from . import _vergence
from ._calibration import Calibration
from ._errors import ArgumentError, Error
from ._surface import option_words, reconstruct
from ._words import PathLike, path_of, words_of

#: Options of `reconstruct` that batch() sets, or that are of images.
_OTHERS = ("left", "right", "calibration", "order", "bayer", "bits", "raw_size", "progress")


@dataclass(frozen=True)
class Row:
    """What became of a pair. `result` is the directory with its files, None if there are none; `error` says why
    then. `pair` is 0 of a session that cannot be read. Depth and sigma are medians in mm, None where the result is
    not metric. `kept`: an earlier run made the result."""

    session: str
    pair: int
    result: Optional[str]
    error: Optional[str] = None
    points: int = 0
    depth_mm: Optional[float] = None
    sigma_mm: Optional[float] = None
    notes: int = 0
    seconds: float = 0
    kept: bool = False

    def __str__(self) -> str:
        name = os.path.basename(self.session) + (f":{self.pair}" if self.pair else "")
        if self.error is not None:
            return f"{name}  {self.error}"
        depth, sigma = ("-" if value is None else f"{value:.4g}" for value in (self.depth_mm, self.sigma_mm))
        return f"{name}  {self.points} points  {depth} mm  sigma {sigma} mm  {self.seconds:.1f} s"


class _Task(NamedTuple):
    """One pair, for this process or a worker. `session`, `out` and `calibration` are paths, or `sent` holds the files of
    the session and the calibration, and those of the result are returned."""

    number: int
    session: str
    pair: int
    out: str
    calibration: Optional[str]  # its file's name
    text: Optional[str]         # of a loaded one
    files: Any
    options: dict[str, Any]
    sent: Optional[dict[str, bytes]] = None


_Files = list[tuple[str, bytes]]


def _read(path: str) -> bytes:
    with open(path, "rb") as file:
        return file.read()


def _sent_name(folder: str, kind: str, path: str) -> str:
    return os.path.join(folder, kind, os.path.basename(path))


def _input_files(task: _Task) -> dict[str, bytes]:
    """What a worker needs: the session's index and calibrations, the frames of this pair, and the calibration."""
    session = task.session
    index = _read(os.path.join(session, "session.index"))
    lines = [line.split() for line in index.split(b"\n") if line.startswith(b"pair ")]
    frames = {f"frame-{word.partition(b'=')[2].decode()}.pnm" for word in lines[task.pair - 1]
              if word.startswith((b"left_frame=", b"right_frame="))}
    wanted = {name for name in os.listdir(session)
              if name in frames or (name.endswith(".txt") and name.startswith(("calibration-", "zoom-")))}
    place = _sent_name("", "session", session)
    files = {os.path.join(place, name): _read(os.path.join(session, name)) for name in sorted(wanted)}
    if task.calibration is not None:
        files[_sent_name("", "calibration", task.calibration)] = _read(task.calibration)
    return {os.path.join(place, "session.index"): index, **files}


def _measure_here(task: _Task) -> Row:
    """Its files appear whole or not at all, so that it can be done twice."""
    begin = time.monotonic()
    try:
        calibration = task.calibration if task.text is None else Calibration.parse(task.text)
        surface = reconstruct(task.session, None, calibration, pair=task.pair, progress=False, **task.options)
        surface.write(task.out, files=task.files, progress=False)
    except Error as error:
        return Row(task.session, task.pair, None, str(error))
    figures = surface.figures
    depth, sigma = figures.get("depth_mm"), figures.get("sigma_mm")
    metric = surface.metric
    return Row(task.session, task.pair, task.out, None, figures["counts"]["vertices"],
               depth["median"] if metric and depth else None, sigma["median"] if metric and sigma else None,
               len(surface.notes), time.monotonic() - begin)


def _measure(task: _Task) -> tuple[Row, _Files]:
    """The work of a task, here or on a worker."""
    if task.sent is None:
        return _measure_here(task), []
    folder = tempfile.mkdtemp(prefix="vergence-")
    try:
        for name, data in task.sent.items():
            os.makedirs(os.path.dirname(os.path.join(folder, name)), exist_ok=True)
            with open(os.path.join(folder, name), "wb") as file:
                file.write(data)
        session, out = _sent_name(folder, "session", task.session), os.path.join(folder, "result")
        rig = task.calibration and _sent_name(folder, "calibration", task.calibration)
        row = _measure_here(task._replace(session=session, out=out, calibration=rig))
        made = [(name, _read(os.path.join(out, name))) for name in sorted(os.listdir(out))
                if not name.startswith(".")] if row.result else []
        error = row.error.replace(session, task.session).replace(rig or session, task.calibration or "") if row.error else None
        return replace(row, session=task.session, result=row.result and task.out, error=error), made
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _client(scheduler: str) -> Any:
    try:
        from distributed import Client
        from distributed.comm import get_address_host_port
    except ImportError:
        raise Error("MISSING", "scheduler requires the package distributed: pip install distributed") from None
    try:
        # A Client without a scheduler waits for 30 s, and 60 s more when it is removed.
        socket.create_connection(get_address_host_port(scheduler), 10).close()
        return Client(scheduler, set_as_default=False)
    except (OSError, ValueError) as error:
        raise Error("IO", f"{scheduler}: no scheduler answers: {error}") from None


def _distribute(tasks: list[_Task], scheduler: str, shared: bool) -> Iterator[tuple[_Task, Row, _Files]]:
    """Each task with its row and files. Only what keeps the workers busy is sent, as it may hold images."""
    client = _client(scheduler)
    from distributed import as_completed
    places: dict[str, tuple[Any, _Task]] = {}
    futures: Any = as_completed(loop=client.loop)

    def submit(task: _Task) -> None:
        sent = task if shared else task._replace(sent=_input_files(task))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it warns of tasks that hold images
            future = client.submit(_measure, sent, pure=False)
        places[future.key] = future, task
        futures.add(future)

    def next_done() -> tuple[_Task, Row, _Files]:
        future = next(futures)
        _, task = places.pop(future.key)
        if future.status == "finished":
            return (task, *future.result())
        # The cluster gave up, or the package is missing there.
        return task, Row(task.session, task.pair, None, str(future.exception())), []
    try:
        room = 2 * max(4, sum(client.nthreads().values()))
        for task in tasks:
            try:
                submit(task)
            except OSError as error:
                yield task, Row(task.session, task.pair, None, str(error)), []
            if len(places) >= room:
                yield next_done()
        while places:
            yield next_done()
    finally:
        client.cancel([future for future, _ in places.values()])
        client.close()


def _check(options: dict[str, Any], scheduler: Any, progress: Any) -> None:
    known = set(inspect.signature(reconstruct).parameters) - set(_OTHERS)
    for name in options:
        if name not in known:
            raise TypeError(f"batch() got an unexpected keyword argument {name!r}")
    if scheduler is not None and not isinstance(scheduler, str):
        raise ArgumentError("ARGUMENT", f"scheduler is {scheduler!r} (expected an address, \"tcp://host:8786\")")
    if progress is not None and not callable(progress):
        raise ArgumentError("ARGUMENT", f"progress is {progress!r} (expected a function, which gets each row)")


def _number(value: Optional[float]) -> float:
    return math.nan if value is None else value


def _row(one: dict[str, Any], target: str) -> Row:
    depth, sigma = (None if math.isnan(one[key]) else one[key] for key in ("depth_mm", "sigma_mm"))
    return Row(one["session"], one["pair"], os.path.join(target, one["name"]) if one["done"] else None, one["error"],
               one["points"], depth, sigma, one["notes"], one["seconds"], one["kept"])


def batch(paths: Union[PathLike, list[PathLike]], out: PathLike,
          calibration: Union[None, Calibration, PathLike] = None, *, scheduler: Optional[str] = None,
          shared_paths: bool = True, files: Optional[list[str]] = None,
          progress: Optional[Callable[[Row], None]] = None, **options: Any) -> list[Row]:
    """Measures every pair of recorded sessions, and returns a row for each, in order.

    paths: a session, a directory of sessions, or a list of them. out: pair 3 of `scene` goes to out/0003, or to
    out/scene/0003 from a directory or list. calibration: a file's name, or loaded; None: the sessions' own. files:
    only these. progress: called with each row as it is known. options: those of `reconstruct`.

    As with "vergence reconstruct --all", out/pairs.json says what the results were made of: the same call again keeps
    those that would be the same and makes the rest, after an interruption or with new pairs.

    scheduler: the address of a Dask scheduler, "tcp://host:8786": each pair is a task with one thread, and
    tasks of a lost worker are done again. The workers need this package and see `paths`, `out` and the
    calibration's file under the same names; with shared_paths=False they see nothing: images are sent with the
    tasks, and the results' files come back. Without it the pairs are measured here, one after the other.

    A pair that cannot be measured is a row with an `error` and does not stop the others."""
    _check(options, scheduler, progress)
    target = os.path.abspath(path_of("out", out))
    sessions = [os.path.abspath(path_of("paths", one)) for one in (paths if isinstance(paths, (list, tuple)) else [paths])]
    words = option_words(**options) + words_of({}, files=files)
    rig = calibration if isinstance(calibration, Calibration) else None
    path = None if rig is not None or calibration is None else os.path.abspath(path_of("calibration", calibration))
    pairs = _vergence.list_pairs(sessions, target, rig._handle if rig else None,
                                 words + (["--calibration", path] if path else []))
    found = [pairs.get(number) for number in range(len(pairs))]
    if len({one["name"] for one in found}) < len(found):
        raise ArgumentError("ARGUMENT", "two sessions have the same name: measure them one by one")
    rows = [_row(one, target) for one in found]
    if scheduler is not None:
        options = {"threads": 1, **options}
    common = (path, rig.text if rig else None, files, options)
    tasks = [_Task(number, row.session, row.pair, os.path.join(target, found[number]["name"]), *common)
             for number, row in enumerate(rows) if row.result is None and row.error is None]

    def show(row: Row) -> None:
        if progress is not None:
            progress(row)
    for row in rows:
        if row.result is not None or row.error is not None:
            show(row)
    done = _distribute(tasks, scheduler, shared_paths) if scheduler is not None and tasks else \
        ((task, _measure_here(task), []) for task in tasks)
    for task, row, made in done:
        if made:
            pairs.store(task.number, made)
        rows[task.number] = row
        pairs.set(task.number, row.error, row.points, row.notes, _number(row.depth_mm), _number(row.sigma_mm),
                  row.seconds)
        show(row)
    return rows
