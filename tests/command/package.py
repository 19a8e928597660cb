# SPDX-License-Identifier: Apache-2.0
"""The Python package over the shared library of the build: its C++ files and nanobind's are compiled, as
`pip install .` does with everything (repository/wheel_test.py)."""
import fcntl
import os
import pathlib
import subprocess
import sys
import sysconfig
import unittest

LIBRARY = pathlib.Path(os.environ["VERGENCE_LIBRARY"]).parent
BUILD = LIBRARY.parent
SOURCE = pathlib.Path(os.environ["VERGENCE_SOURCE"])
CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "vergence"
REQUIREMENTS = "nanobind==2.9.2 scikit-build-core==0.11.6\n"
FLAGS = ("-std=c++17", "-O2", "-fPIC", "-fvisibility=hidden", "-fno-strict-aliasing", "-DNDEBUG")


def tools():
    """The Python of an environment that has what the build of the package requires; made once."""
    home = CACHE / "venv-package"
    python, made_of = home / "bin/python3", home / "made_of"
    CACHE.mkdir(parents=True, exist_ok=True)
    with open(CACHE / "venv-package.lock", "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not made_of.is_file() or made_of.read_text() != REQUIREMENTS:
            for words in (["/usr/bin/python3", "-m", "venv", "--clear", "--system-site-packages", home],
                          [python, "-m", "pip", "install", "--quiet", *REQUIREMENTS.split()]):
                done = subprocess.run(words, capture_output=True, text=True)
                if done.returncode != 0:
                    reason = (done.stderr or done.stdout).strip().splitlines()[-1]
                    raise unittest.SkipTest(f"nanobind and scikit-build-core cannot be installed: {reason}")
            made_of.write_text(REQUIREMENTS)
    return python


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)
    if done.returncode != 0:
        raise AssertionError(f"{words}\n{done.stdout}{done.stderr}")
    return done.stdout


def build():
    """Makes the package importable as `vergence`; returns the folder to add to the path."""
    found = run(tools(), "-c", "import nanobind as n; print(n.include_dir(), n.source_dir())").split()
    include, source = map(pathlib.Path, found)
    folder = BUILD / "package"
    package = folder / "vergence"
    package.mkdir(parents=True, exist_ok=True)
    includes = [f"-I{include}", f"-I{include.parent}/ext/robin_map/include",
                f"-I{sysconfig.get_paths()['include']}", f"-I{BUILD}/source"]
    environment = {**os.environ, "CCACHE_BASEDIR": str(BUILD), "CCACHE_NOHASHDIR": "1"}
    with open(folder / "lock", "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        warnings = ("-Wall", "-Wextra", "-Wshadow", "-Werror")
        ours = [BUILD / "source/library/python" / name for name in ("module.cpp", "pairs.cpp")]
        for name, options in [(source / "nb_combined.cpp", ()), *((name, warnings) for name in ours)]:
            run("ccache", "g++", *FLAGS, *options, *(flag.replace("-I", "-isystem") if "nanobind" in flag or
                                                     "python" in flag else flag for flag in includes),
                "-c", name, "-o", folder / (name.stem + ".o"), env=environment)
        # Another test may be importing the module of an earlier build: the new one replaces it whole.
        linked = folder / "_vergence.abi3.so"
        run("g++", "-shared", "-o", linked, *(folder / f"{name.stem}.o" for name in ours), folder / "nb_combined.o",
            f"-L{LIBRARY}", "-lvergence", f"-Wl,-rpath,{LIBRARY}")
        linked.replace(package / linked.name)
        for file in (SOURCE / "library/python/vergence").iterdir():
            link = package / file.name
            if not link.is_symlink() and file.suffix in (".py", ".pyi", ".typed"):
                link.symlink_to(file)
    return folder


def load():
    """Imports the package."""
    sys.path.insert(0, str(build()))
    import vergence
    return vergence
