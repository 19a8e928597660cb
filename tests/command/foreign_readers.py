# SPDX-License-Identifier: Apache-2.0
"""Third-party readers of PLY, PCD, glTF, MCAP and bags, installed once into the user's cache.

Versions are pinned, so that a new release does not break a test.
"""
import fcntl
import json
import os
import pathlib
import subprocess
import sys

# All that the two readers need but numpy, which stays the one that the system's OpenCV was built for.
PYTHON_PACKAGES = ["plyfile==1.0.3", "pypcd4==1.5.1", "pydantic==2.14.3", "pydantic-core==2.50.4",
                   "annotated-types==0.8.0", "typing-extensions==4.16.0",
                   "typing-inspection==0.4.5", "python-neo-lzf==0.3.5"]
RECORDING_PACKAGES = ["rosbags==0.11.9", "mcap==1.6.0", "lz4==4.4.5", "zstandard==0.25.0",
                      "ruamel.yaml==0.19.1", "apsw==3.54.1.0", "backports.zstd==1.8.0", "typing-extensions==4.16.0"]
NODE_PACKAGES = ["gltf-validator@2.0.0-dev.3.10", "meshoptimizer@0.22.0"]
RETRY = os.path.join(os.environ["VERGENCE_SOURCE"], "tools", "retry")

VALIDATE = """
const validator = require('gltf-validator');
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[1]));
validator.validateBytes(bytes, {maxIssues: 20}).then(
    report => console.log(JSON.stringify(report)),
    error => { console.error(error); process.exit(1); });
"""


# Part of a GLB's buffer view by meshoptimizer's own decoder, from standard input to standard output.
UNPACK = """
const MeshoptDecoder = require('meshoptimizer/meshopt_decoder.js');
const packed = new Uint8Array(require('fs').readFileSync(0));
const [count, stride, mode, filter] = process.argv.slice(1);
MeshoptDecoder.ready.then(() => {
    const plain = new Uint8Array(count * stride);
    MeshoptDecoder.decodeGltfBuffer(plain, Number(count), Number(stride), packed, mode, filter);
    process.stdout.write(plain);
});
"""


def cache():
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    path = pathlib.Path(base) / "vergence"
    path.mkdir(parents=True, exist_ok=True)
    return path


def install_once(folder, wanted, *commands):
    """Runs `commands` unless `folder` says that `wanted` is there already. Tests run side by side:
    the first takes the lock, the others wait for it."""
    folder.mkdir(parents=True, exist_ok=True)
    stamp = folder / "installed"
    with open(folder / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if stamp.exists() and stamp.read_text() == wanted:
            return
        print(f"installing {wanted} into {folder}", flush=True)
        for command in commands:
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode != 0:
                raise RuntimeError(f"{' '.join(command)} failed:\n{done.stdout}{done.stderr}")
        stamp.write_text(wanted)


def python_packages(name, packages):
    """Installs packages, and finds their modules before the system's, which may be too old."""
    folder = cache() / name
    install_once(folder, " ".join(packages),
                 ["rm", "-rf", str(folder / "lib")],
                 [RETRY, sys.executable, "-m", "pip", "install", "--quiet",
                  "--disable-pip-version-check", "--no-deps", "--target", str(folder / "lib"), *packages])
    sys.path.insert(0, str(folder / "lib"))


def python_readers():
    """The modules plyfile and pypcd4."""
    python_packages("python-readers", PYTHON_PACKAGES)
    import plyfile
    import pypcd4
    return plyfile, pypcd4


def recording_readers():
    """The modules rosbags and mcap."""
    python_packages("recording-readers", RECORDING_PACKAGES)
    import mcap.reader
    import mcap.writer
    import rosbags.highlevel
    import rosbags.rosbag1
    import rosbags.rosbag2
    import rosbags.typesys
    return rosbags, mcap


def run_node(script, *arguments, data=None):
    folder = cache() / "npm"
    install_once(folder, " ".join(NODE_PACKAGES),
                 [RETRY, "npm", "install", "--silent", "--no-fund", "--no-audit", "--prefix",
                  str(folder), *NODE_PACKAGES])
    done = subprocess.run(["node", "-e", script, "--", *map(str, arguments)], capture_output=True,
                          input=data, env={**os.environ, "NODE_PATH": str(folder / "node_modules")})
    if done.returncode != 0:
        raise RuntimeError(f"node failed: {done.stderr.decode()}")
    return done.stdout


def validate_gltf(path):
    """The report of the Khronos validator on a .glb file, as a dictionary."""
    return json.loads(run_node(VALIDATE, path))


def glb(path):
    """The document of a .glb file and the bytes of each accessor, unpacked."""
    data = pathlib.Path(path).read_bytes()
    length = int.from_bytes(data[12:16], "little")
    document, binary = json.loads(data[20:20 + length]), data[28 + length:]
    parts = []
    for accessor in document["accessors"]:
        view = document["bufferViews"][accessor["bufferView"]]
        packed = view.get("extensions", {}).get("EXT_meshopt_compression")
        at = (packed or view).get("byteOffset", 0)
        part = binary[at:at + (packed or view)["byteLength"]]
        if packed:
            part = run_node(UNPACK, packed["count"], packed["byteStride"], packed["mode"],
                            packed.get("filter", "NONE"), data=part)
        parts.append(part)
    return document, parts
