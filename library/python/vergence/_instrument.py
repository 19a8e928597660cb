# SPDX-License-Identifier: Apache-2.0
"""A client of the daemon `vergenced`: commands over its socket or TCP port, as JSON (the protocol:
daemon/manual.md, "Commands and answers")."""
from __future__ import annotations

import base64
import json
import os
import re
import shutil
import socket
import tempfile
import weakref
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple, NoReturn, Optional, Union

import numpy as np

from ._calibration import Calibration
from ._errors import ArgumentError, Error
from ._surface import Surface, reconstruct
from ._words import PathLike, Progress

_BLOCK_BYTES = 49152
_LINE_BYTES = 512  # the longest command
_ANSWER_BYTES = 1 << 22


class Pictures(NamedTuple):
    """What both cameras see: uint8 (height, width) or (height, width, 3) RGB."""

    left: np.ndarray
    right: np.ndarray


class Pair:
    """A captured pair: a session in the directory `path`, `left` and `right` as they were captured."""

    def __init__(self, path: str, temporary: Optional[str] = None) -> None:
        self.path = path
        if temporary is not None:
            weakref.finalize(self, shutil.rmtree, temporary, ignore_errors=True)

    def reconstruct(self, calibration: Union[None, Calibration, PathLike] = None, **options: Any) -> Surface:
        """`vergence.reconstruct` of it; without a calibration with the one that the pair carries."""
        return reconstruct(self.path, None, calibration, **options)

    def _frame(self, side: str) -> np.ndarray:
        with open(os.path.join(self.path, "session.index"), encoding="ascii") as index:
            pairs = [line for line in index if line.startswith("pair ")]
        name = re.search(rf" {side}_frame=([0-9a-f]+)", pairs[-1])
        if name is None:
            raise Error("SYNTAX", f"{self.path}: the session is damaged")
        with open(os.path.join(self.path, f"frame-{name[1]}.pnm"), "rb") as file:
            data = file.read()
        head = re.match(rb"(P[56])\s+(\d+)\s+(\d+)\s+(\d+)\s", data)
        if head is None:
            raise Error("SYNTAX", f"{self.path}: a frame is damaged")
        width, height, channels = int(head[2]), int(head[3]), 3 if head[1] == b"P6" else 1
        kind = np.dtype(">u2" if int(head[4]) > 255 else "u1")
        pixels = np.frombuffer(data, kind, width * height * channels, head.end())
        shape = (height, width, 3) if channels == 3 else (height, width)
        return pixels.reshape(shape).astype(kind.newbyteorder("="))

    @property
    def left(self) -> np.ndarray:
        """The left frame, uint8 or uint16; of colour sensors the mosaic."""
        return self._frame("left")

    @property
    def right(self) -> np.ndarray:
        """The right frame."""
        return self._frame("right")

    def __repr__(self) -> str:
        return f"<Pair {self.path}>"


def _default_addresses() -> list[str]:
    addresses = []
    if os.geteuid() != 0:
        for variable, default in (("XDG_RUNTIME_DIR", ""), ("XDG_STATE_HOME", os.path.expanduser("~/.local/state"))):
            folder = os.environ.get(variable, default)
            if folder.startswith("/"):
                addresses.append(f"unix:{folder}/vergence/vergenced.sock")
    return [*addresses, "unix:/run/vergence/vergenced.sock"]


def _open(address: str, timeout_s: float) -> socket.socket:
    kind, _, rest = address.partition(":")
    if kind == "unix":
        opened = socket.socket(socket.AF_UNIX)
        try:
            opened.settimeout(timeout_s)
            opened.connect(rest)
        except BaseException:
            opened.close()
            raise
        return opened
    host, _, port = rest.rpartition(":")
    if kind == "tcp" and host and port.isdecimal() and 0 < int(port) < 65536:
        return socket.create_connection((host, int(port)), timeout_s)
    raise ArgumentError("ARGUMENT", f"{address}: not an address (expected unix:PATH or tcp:HOST:PORT)")


def _token_path() -> str:
    state = os.environ.get("XDG_STATE_HOME", "")
    if state.startswith("/"):
        return state + "/vergence/tcp_token"
    if os.geteuid() == 0:
        return "/var/lib/vergence/tcp_token"
    return os.path.expanduser("~/.local/state/vergence/tcp_token")


def _read_token(path: PathLike) -> str:
    try:
        with open(path, encoding="ascii") as file:
            return file.read().strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not a token"
        raise Error("NOT_CONNECTED", f"{os.fspath(path)}: {reason} (the token of the TCP port: copy it from the "
                                     "instrument, or name its file, token=)") from None


def _spell(given: Any) -> Any:
    if given is True:
        return "yes"
    return "no" if given is False else given


class Instrument:
    """A connection; made by `connect`. Every command of the console is a call: `rig("zoom 5x")`, and those
    of daily use are methods. A call returns the items of the answer as a dictionary; "ERR" raises `Error`.
    One thread at a time; Ctrl-C cancels the running command on the instrument, too."""

    def __init__(self, address: str, opened: socket.socket, token: Optional[PathLike]) -> None:
        self.address = address
        self._socket: Optional[socket.socket] = opened
        self._left = b""
        try:
            if address.startswith("tcp:"):
                self._send("@token " + _read_token(_token_path() if token is None else token))
                self._expect_ok()
            self._send("@text")
            self._expect_ok()
            opened.settimeout(None)
        except BaseException as error:
            self.close()
            if isinstance(error, OSError) and not isinstance(error, Error):
                raise Error("NOT_CONNECTED", f"{address}: {error.strerror or error}") from error
            raise

    def _expect_ok(self) -> None:
        line = self._line()
        if line != b"OK":
            text = line.decode("ascii", "replace")
            raise Error("NOT_CONNECTED", f"{self.address}: {text or 'not vergenced'}")

    def close(self) -> None:
        """Ends the connection; a running command is cancelled."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def __enter__(self) -> "Instrument":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Instrument {self.address}{'' if self._socket else ', closed'}>"

    def _send(self, line: str) -> None:
        if self._socket is None:
            raise Error("NOT_CONNECTED", f"{self.address}: the connection is closed")
        if "\n" in line or "\r" in line:
            raise ArgumentError("ARGUMENT", "a command is one line")
        try:
            self._socket.sendall(line.encode() + b"\n")
        except ConnectionError:
            self._lost()

    def _lost(self) -> NoReturn:
        self.close()
        raise Error("NOT_CONNECTED", f"{self.address}: vergenced has closed the connection") from None

    def _receive(self) -> None:
        assert self._socket is not None
        try:
            block = self._socket.recv(1 << 20)
        except ConnectionError:
            block = b""
        if not block:
            self._lost()
        self._left += block

    def _line(self) -> bytes:
        while b"\n" not in self._left:
            if len(self._left) > _ANSWER_BYTES:
                raise Error("SYNTAX", f"{self.address}: not an answer of vergenced")
            self._receive()
        line, self._left = self._left.split(b"\n", 1)
        return line.rstrip(b"\r")

    def _bytes(self, count: int) -> bytes:
        while len(self._left) < count:
            self._receive()
        data, self._left = self._left[:count], self._left[count:]
        return data

    def _answer(self, progress: Progress) -> dict[str, Any]:
        while True:
            try:
                answer = json.loads(self._line())
            except ValueError:
                raise Error("SYNTAX", f"{self.address}: not an answer of vergenced") from None
            if answer.get("event") != "progress":
                return answer
            if callable(progress) and answer.get("total"):
                progress(str(answer.get("what", "")), answer.get("done", 0) / answer["total"])

    def _ask(self, line: str, options: str, progress: Progress = None) -> dict[str, Any]:
        self._send(f"@{options} {line}")
        try:
            answer = self._answer(progress)
        except KeyboardInterrupt:
            if self._socket is not None:
                self._socket.sendall(b"\x03")
                late = self._answer(None)
                if "binary" in options and late.get("ok"):
                    self._bytes(int(late["result"]["bytes"]))
            raise
        if not answer.get("ok"):
            raise Error(answer.get("error", "UNKNOWN"), answer.get("message") or answer.get("error", ""))
        return answer.get("result") or {}

    def __call__(self, command: str, *, progress: Progress = None) -> dict[str, Any]:
        """Any command line of the console ("help" lists them). progress: called with what and the share
        done of a long one."""
        return self._ask(command, "json,progress" if callable(progress) else "json", progress)

    def status(self) -> dict[str, Any]:
        """The state of the instrument."""
        return self("status")

    def bringup(self, **options: Any) -> dict[str, Any]:
        """Makes it ready: first of all, and after a failure."""
        return self._command("bringup", None, options)

    def _command(self, name: str, value: Any, options: dict[str, Any]) -> dict[str, Any]:
        progress = options.pop("progress", None)
        words = [name] + ([] if value is None else [str(value)])
        words += [f"{key.replace('_', '-')}={_spell(given)}" for key, given in options.items()]
        return self(" ".join(words), progress=progress)

    def zoom(self, value: Any = None, **options: Any) -> dict[str, Any]:
        """zoom("5x"), or of one side: zoom("5x", side="left"); without a value: where it is."""
        return self._command("zoom", value, options)

    def focus(self, value: Any = None, **options: Any) -> dict[str, Any]:
        """focus("1.8 m")."""
        return self._command("focus", value, options)

    def iris(self, value: Any = None, **options: Any) -> dict[str, Any]:
        """iris("f/8")."""
        return self._command("iris", value, options)

    def pan(self, value: Any = None, **options: Any) -> dict[str, Any]:
        """pan(3.97, right=-3.97): degrees."""
        return self._command("pan", value, options)

    def exposure(self, value: Any = None, **options: Any) -> dict[str, Any]:
        """exposure("1/100")."""
        return self._command("exposure", value, options)

    def gain(self, value: Any = None, **options: Any) -> dict[str, Any]:
        """gain(2)."""
        return self._command("gain", value, options)

    def autofocus(self, **options: Any) -> dict[str, Any]:
        """Focuses both cameras by their own pictures."""
        return self._command("autofocus", None, options)

    def autoexpose(self, **options: Any) -> dict[str, Any]:
        """Finds exposure and gain."""
        return self._command("autoexpose", None, options)

    def capture(self, name: Optional[str] = None, *, to: Optional[PathLike] = None, **options: Any) -> Pair:
        """Takes a pair and fetches it. name: it stays on the instrument as this session; None: it is
        removed there. to: the directory for the session, which must not exist or be empty; None: a
        temporary one, removed with the Pair."""
        if to is not None and os.path.lexists(to) and (not os.path.isdir(to) or os.listdir(to)):
            raise ArgumentError("ARGUMENT", f"{os.fspath(to)}: exists and is not empty (name a new directory)")
        wanted = name or f"python-{os.urandom(6).hex()}"
        self._command("capture", wanted, options)
        temporary = tempfile.mkdtemp(prefix="vergence-") if to is None else None
        pair = Pair(os.path.join(temporary, wanted) if to is None and temporary else os.fspath(to or ""),
                    temporary)
        try:
            self._fetch_directory(wanted, pair.path)
        finally:
            if name is None:
                self(f"remove {wanted}")
        return pair

    def _fetch_directory(self, name: str, path: str) -> None:
        os.makedirs(path, exist_ok=True)
        for entry in self(f"files {name}").get("files", []):
            file = os.path.basename(entry.get("file", ""))
            if not file:
                continue  # a directory
            with open(os.path.join(path, file), "wb") as out:
                out.write(self.fetch(f"{name}/{file}"))

    def fetch(self, name: str) -> bytes:
        """The contents of a file of the instrument."""
        whole = self(f"fetch {name}")
        data = bytearray()
        while len(data) < int(whole["size"]):
            block = self(f"fetch {name} offset={len(data)} bytes={_BLOCK_BYTES}")
            part = base64.b64decode(block["data"])
            if not part or zlib.crc32(part) != int(block["crc"], 16):
                raise Error("CRC", f"{name}: damaged on the way (try again)")
            data += part
        if zlib.crc32(data) != int(whole["crc"], 16):
            raise Error("CRC", f"{name}: changed during the transfer (try again)")
        return bytes(data)

    def look(self, side_px: Optional[int] = None, *, colour: bool = True) -> Pictures:
        """One picture of both cameras as they see now, reduced to at most `side_px` a side (default 640)."""
        line = "stream" + ("" if side_px is None else f" side={side_px}") + ("" if colour else " colour=no")
        result = self._ask(line, "json,binary")
        try:
            data = self._bytes(int(result["bytes"]))
        except KeyboardInterrupt:
            self._bytes(int(result["bytes"]))  # or the next answer begins within the picture
            raise
        shape = int(result["height"]), int(result["width"]), int(result["channels"])
        both = np.frombuffer(data, np.uint8, shape[0] * shape[1] * shape[2]).reshape(shape)
        both = both[:, :, 0] if shape[2] == 1 else both
        return Pictures(both[:, :shape[1] // 2], both[:, shape[1] // 2:])

    def stream(self, side_px: Optional[int] = None, *, colour: bool = True) -> Iterator[Pictures]:
        """Pictures one after the other, each as the cameras see when it is asked for: a slow reader gets
        fewer, never old ones."""
        while True:
            yield self.look(side_px, colour=colour)


def connect(address: Optional[str] = None, *, token: Optional[PathLike] = None,
            timeout_s: float = 5) -> Instrument:
    """Connects to a running `vergenced`. address: "unix:PATH" or "tcp:HOST:PORT"; None: the user's socket,
    then the system's. token: file with the token of a TCP port; None: as the client `vergence` finds it.
    timeout_s: for the connection and its first answer."""
    last: Optional[OSError] = None
    addresses = _default_addresses() if address is None else [address]
    for one in addresses:
        try:
            return Instrument(one, _open(one, timeout_s), token)
        except OSError as error:
            last = error
    reason = "" if last is None else f": {last.strerror or last}"
    raise Error("NOT_CONNECTED", f"{addresses[-1]}{reason} (is vergenced running?)")
