# SPDX-License-Identifier: Apache-2.0
"""The reference in a directory: regress/reference.json, one packed file per pair next to it, and
regress/options.json, which the user writes."""
import json
import pathlib
import re
import zlib

from files import make_directory, write_whole
from result import TOLERANCES, Result, crc_text
from session import Unusable, read_regular

FOLDER, REFERENCE, OPTIONS = "regress", "reference.json", "options.json"
# Options of vergence reconstruct that a directory may set: they define the measurement, and none of
# them names a file. Directories are exchanged between users and must not choose where to write.
MEASURES = ("--depth", "--disparity", "--region", "--scale", "--rectified", "--focal", "--baseline",
            "--unit", "--first-camera", "--bayer", "--bits", "--raw", "--preset", "--no-refine",
            "--keep-all", "--speckle")
PACKED = re.compile(r"pair(-[0-9]+)?-[0-9a-f]{8}\.npz")  # only these files are ever removed


class Damaged(Unusable):
    """A damaged file; `kept` are the acceptances that can still be read."""

    def __init__(self, text, kept=()):
        super().__init__(text)
        self.kept = list(kept)


def read_json(path):
    try:
        value = json.loads(read_regular(path).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise Damaged(f"{path}: not JSON ({error})") from error
    if not isinstance(value, dict):
        raise Damaged(f"{path}: must be a JSON object")
    return value


def check_arguments(path, arguments):
    """Checks options and values alike: neither may look like another option. Negative numbers are
    values."""
    if not isinstance(arguments, list) or not all(
            isinstance(word, str) and word.isprintable() for word in arguments):
        raise Unusable(f"{path}: arguments must be a list of printable strings")
    for word in arguments:
        name = word.partition("=")[0]
        if re.match("-[^0-9.]", word) and name not in MEASURES:
            raise Unusable(f"{path}: option {name} is not allowed; see tools/regress --help")


def read_options(folder):
    """Arguments of vergence reconstruct, and tolerances, which default to 0."""
    path = pathlib.Path(folder) / FOLDER / OPTIONS
    options = read_json(path) if path.exists() else {}
    unknown = set(options) - {"arguments", "tolerance"}
    tolerance = options.get("tolerance", {})
    arguments = options.get("arguments", [])
    if unknown:
        raise Unusable(f"{path}: unknown key \"{sorted(unknown)[0]}\" "
                       "(expected arguments or tolerance)")
    check_arguments(path, arguments)
    if not isinstance(tolerance, dict) or set(tolerance) - set(TOLERANCES):
        raise Unusable(f"{path}: unknown tolerance (expected {', '.join(TOLERANCES)})")
    for name, value in tolerance.items():
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not value >= 0:
            raise Unusable(f"{path}: {name} must be a number >= 0")
    return arguments, {name: tolerance.get(name, 0) for name in TOLERANCES}


def own_crc(reference):
    reported = {key: value for key, value in reference.items() if key != "crc32"}
    return f"{zlib.crc32(json.dumps(reported, sort_keys=True).encode()):08x}"


def list_of(value):
    return value if isinstance(value, list) else []


def has_texts(value, *names):
    return isinstance(value, dict) and all(isinstance(value.get(name), str) for name in names)


def is_acceptance(value):
    return has_texts(value, "date", "build", "reason")


def is_pair(value):
    """Whether `value` is an entry as `save` writes it, with a file in the same folder."""
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
        raise Damaged(f"{path}: damaged or edited (wrong CRC-32)", kept)
    if not accepted or kept != accepted or not pairs or not all(map(is_pair, pairs)):
        raise Damaged(f"{path}: not a reference as written by --accept", kept)
    return reference


def load(folder):
    """The reference results, and the contents of reference.json."""
    path = pathlib.Path(folder) / FOLDER / REFERENCE
    if not path.exists():
        raise Unusable(f"{folder}: no reference; create one with --accept REASON")
    reference = read_reference(path)
    results = []
    for entry in reference["pairs"]:
        file = path.parent / entry["file"]
        data = read_regular(file)
        if crc_text(data) != entry["crc32"]:
            raise Unusable(f"{file}: damaged (wrong CRC-32)")
        results.append(Result.of_packed(data, entry["figures"]))
    return results, reference


def history_of(path):
    """Acceptances of the replaced reference, and a note if it is damaged. Readable acceptances are
    kept even then, as they document the history."""
    if not path.exists():
        return [], None
    try:
        return read_reference(path)["accepted"], None
    except Damaged as damage:
        return damage.kept, f"{damage}; acceptances kept: {len(damage.kept)}"


def save(folder, names, results, reason, build, date):
    """Replaces the reference; the file that names the others is written last. Returns a note for
    the user, or None. Old files are found by their name pattern, not through the old reference,
    which might name any file."""
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
