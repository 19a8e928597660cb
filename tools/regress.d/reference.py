# SPDX-License-Identifier: Apache-2.0
"""The reference that stands in a directory: regress/reference.json, one packed file for each pair
beside it, and regress/options.json, which people write."""
import json
import pathlib
import re
import zlib

from files import make_directory, write_whole
from result import TOLERANCES, Result, crc_text
from session import Unusable, read_regular

FOLDER, REFERENCE, OPTIONS = "regress", "reference.json", "options.json"
# What of vergence reconstruct's options a directory may set: those that say how to measure, and none
# that names a file. Directories are exchanged between people, and must not write where they want.
MEASURES = ("--depth", "--disparity", "--region", "--scale", "--rectified", "--focal", "--baseline",
            "--unit", "--first-camera", "--bayer", "--bits", "--raw", "--preset", "--no-refine",
            "--keep-all", "--speckle")
PACKED = re.compile(r"pair(-[0-9]+)?-[0-9a-f]{8}\.npz")  # the only files that are removed again


class Damaged(Unusable):
    """What was read is not what was written; `kept` are acceptances that can be read even so."""

    def __init__(self, text, kept=()):
        super().__init__(text)
        self.kept = list(kept)


def read_json(path):
    try:
        value = json.loads(read_regular(path).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise Damaged(f"{path}: is no JSON ({error})") from error
    if not isinstance(value, dict):
        raise Damaged(f"{path}: must be a JSON object")
    return value


def check_arguments(path, arguments):
    """Whether an option or a value comes next does not matter: neither may look like an option that
    says something else. Negative numbers are values."""
    if not isinstance(arguments, list) or not all(
            isinstance(word, str) and word.isprintable() for word in arguments):
        raise Unusable(f"{path}: arguments must be a list of printable texts")
    for word in arguments:
        name = word.partition("=")[0]
        if re.match("-[^0-9.]", word) and name not in MEASURES:
            raise Unusable(f"{path}: {name} does not say how to measure; see tools/regress --help")


def read_options(folder):
    """Arguments of vergence reconstruct, and tolerances: 0 where none is given."""
    path = pathlib.Path(folder) / FOLDER / OPTIONS
    options = read_json(path) if path.exists() else {}
    unknown = set(options) - {"arguments", "tolerance"}
    tolerance = options.get("tolerance", {})
    arguments = options.get("arguments", [])
    if unknown:
        raise Unusable(f"{path}: unknown key {sorted(unknown)[0]}; there are arguments, tolerance")
    check_arguments(path, arguments)
    if not isinstance(tolerance, dict) or set(tolerance) - set(TOLERANCES):
        raise Unusable(f"{path}: tolerance may have {', '.join(TOLERANCES)}")
    for name, value in tolerance.items():
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not value >= 0:
            raise Unusable(f"{path}: {name} must be a number from 0 on")
    return arguments, {name: tolerance.get(name, 0) for name in TOLERANCES}


def own_crc(reference):
    told = {key: value for key, value in reference.items() if key != "crc32"}
    return f"{zlib.crc32(json.dumps(told, sort_keys=True).encode()):08x}"


def list_of(value):
    return value if isinstance(value, list) else []


def has_texts(value, *names):
    return isinstance(value, dict) and all(isinstance(value.get(name), str) for name in names)


def is_acceptance(value):
    return has_texts(value, "date", "build", "reason")


def is_pair(value):
    """Whether `value` is an entry as `save` makes them: its file is one beside it."""
    if not has_texts(value, "name", "file", "crc32") or not PACKED.fullmatch(value["file"]):
        return False
    figures = value.get("figures")
    return isinstance(figures, dict) and all(
        figure is None or isinstance(figure, (int, float)) for figure in figures.values())


def read_reference(path):
    reference = read_json(path)
    accepted, pairs = list_of(reference.get("accepted")), list_of(reference.get("pairs"))
    kept = list(filter(is_acceptance, accepted))
    if reference.get("crc32") != own_crc(reference):
        raise Damaged(f"{path}: is damaged or was edited (its CRC-32 is another)", kept)
    if not accepted or kept != accepted or not pairs or not all(map(is_pair, pairs)):
        raise Damaged(f"{path}: is not of the form that --accept writes", kept)
    return reference


def load(folder):
    """The reference results, and all that reference.json says."""
    path = pathlib.Path(folder) / FOLDER / REFERENCE
    if not path.exists():
        raise Unusable(f"{folder}: has no reference yet; make one with --accept REASON")
    reference = read_reference(path)
    results = []
    for entry in reference["pairs"]:
        file = path.parent / entry["file"]
        data = read_regular(file)
        if crc_text(data) != entry["crc32"]:
            raise Unusable(f"{file}: is damaged (its CRC-32 is another)")
        results.append(Result.of_packed(data, entry["figures"]))
    return results, reference


def history_of(path):
    """Acceptances of the reference that is replaced, and what is to be told of it if it is damaged.
    They are texts for people: those that can be read are worth keeping even then."""
    if not path.exists():
        return [], None
    try:
        return read_reference(path)["accepted"], None
    except Damaged as damage:
        return damage.kept, f"{damage}; {len(damage.kept) or 'none'} of its acceptances can be kept"


def save(folder, names, results, reason, build, date):
    """A new reference in place of what was there. The file that names the others comes last.
    Returns a line to be told, or None. What is removed is found by its name, not by the old
    reference, which may name any file."""
    where = pathlib.Path(folder) / FOLDER
    make_directory(where)
    path = where / REFERENCE
    history, note = history_of(path)
    entries, made = [], []
    try:
        for name, result in zip(names, results):
            data = result.packed()
            file = f"{name.replace(' ', '-')}-{crc_text(data)}.npz"
            if not (where / file).exists():
                made.append(where / file)
            write_whole(where / file, data)
            entries.append({"name": name, "file": file, "crc32": crc_text(data),
                            "figures": result.figures})
        reference = {"accepted": history + [{"date": date, "build": build, "reason": reason}],
                     "pairs": entries}
        reference["crc32"] = own_crc(reference)
        write_whole(path, (json.dumps(reference, indent=1) + "\n").encode())
    except BaseException:
        for file in made:
            file.unlink(missing_ok=True)
        raise
    for file in where.iterdir():
        old = file.name not in {entry["file"] for entry in entries}
        if old and PACKED.fullmatch(file.name.removesuffix(".part")) and not file.is_dir():
            file.unlink()
    return note
