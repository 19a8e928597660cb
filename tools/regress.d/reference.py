# SPDX-License-Identifier: Apache-2.0
"""The reference that stands in a directory: regress/reference.json, one packed file for each pair
beside it, and regress/options.json, which people write."""
import json
import pathlib
import zlib

from result import TOLERANCES, Result, crc_text
from session import Unusable

FOLDER, REFERENCE, OPTIONS = "regress", "reference.json", "options.json"


def read_json(path):
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise Unusable(f"{path}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise Unusable(f"{path}: is no JSON ({error})") from error
    if not isinstance(value, dict):
        raise Unusable(f"{path}: must be a JSON object")
    return value


def read_options(folder):
    """Arguments of vergence reconstruct, and tolerances: 0 where none is given."""
    path = pathlib.Path(folder) / FOLDER / OPTIONS
    options = read_json(path) if path.exists() else {}
    unknown = set(options) - {"arguments", "tolerance"}
    tolerance = options.get("tolerance", {})
    arguments = options.get("arguments", [])
    if unknown:
        raise Unusable(f"{path}: unknown key {sorted(unknown)[0]}; there are arguments, tolerance")
    if not isinstance(arguments, list) or not all(isinstance(a, str) for a in arguments):
        raise Unusable(f"{path}: arguments must be a list of texts")
    if not isinstance(tolerance, dict) or set(tolerance) - set(TOLERANCES):
        raise Unusable(f"{path}: tolerance may have {', '.join(TOLERANCES)}")
    for name, value in tolerance.items():
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not value >= 0:
            raise Unusable(f"{path}: {name} must be a number from 0 on")
    return arguments, {name: tolerance.get(name, 0) for name in TOLERANCES}


def own_crc(reference):
    told = {key: value for key, value in reference.items() if key != "crc32"}
    return f"{zlib.crc32(json.dumps(told, sort_keys=True).encode()):08x}"


def load(folder):
    """The reference results, and all that reference.json says."""
    path = pathlib.Path(folder) / FOLDER / REFERENCE
    if not path.exists():
        raise Unusable(f"{folder}: has no reference yet; make one with --accept REASON")
    reference = read_json(path)
    if reference.get("crc32") != own_crc(reference):
        raise Unusable(f"{path}: is damaged or was edited (its CRC-32 is another)")
    results = []
    for entry in reference["pairs"]:
        file = path.parent / entry["file"]
        try:
            data = file.read_bytes()
        except OSError as error:
            raise Unusable(f"{file}: cannot be read ({error.strerror})") from error
        if crc_text(data) != entry["crc32"]:
            raise Unusable(f"{file}: is damaged (its CRC-32 is another)")
        results.append(Result.of_packed(data, entry["figures"]))
    return results, reference


def save(folder, names, results, reason, build, date):
    """A new reference in place of what was there. The file that names the others comes last."""
    where = pathlib.Path(folder) / FOLDER
    where.mkdir(exist_ok=True)
    path = where / REFERENCE
    history, old = [], []
    if path.exists():
        before = read_json(path)
        history = before.get("accepted", [])
        old = [entry["file"] for entry in before.get("pairs", [])]
    entries = []
    for name, result in zip(names, results):
        data = result.packed()
        file = f"{name.replace(' ', '-')}-{crc_text(data)}.npz"
        (where / file).write_bytes(data)
        entries.append({"name": name, "file": file, "crc32": crc_text(data),
                        "figures": result.figures})
    reference = {"accepted": history + [{"date": date, "build": build, "reason": reason}],
                 "pairs": entries}
    reference["crc32"] = own_crc(reference)
    part = where / (REFERENCE + ".part")
    part.write_text(json.dumps(reference, indent=1) + "\n", encoding="utf-8")
    part.replace(path)
    for file in set(old) - {entry["file"] for entry in entries}:
        (where / file).unlink(missing_ok=True)
