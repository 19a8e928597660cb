#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""usage: tests/select_tests.py --changed BUILD [BASE]
       tests/select_tests.py --matching BUILD REGEX PART
       tests/select_tests.py --targets BUILD NAMES

Which tests to run and what to build for them, for tools/test. BUILD is a configured build folder.

  --changed   prints, a line each, the tests that the difference from the commit BASE can break (default:
              where the branch left main, or the commit before), as NAMES; why goes to standard error
  --matching  prints the tests whose name matches: of PART "quick" those with this label, of "sanitize" those
              with this label or quick, of "release" all but the latter
  --targets   prints ninja's targets that the tests need; NAMES is a regular expression

A test in C++ is chosen if #include leads from its source to a changed file, where a header leads on to the
sources of its name; one without the label quick only if it includes something of that folder itself.
A test in Python is chosen if its text, or that of a module of the tests that it imports, changed; if it
names a changed file; or if one of its programs holds a changed file, and its name or docstring has a word
that WORDS gives for that folder. Tests of what is farther away are left to the whole of tools/test.
"""
import ast
import collections
import functools
import json
import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True
import slow_tests  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[1]
# Programs by the variables that lead tests in Python to them, and the folders whose main function is theirs.
PROGRAMS = {
    "VERGENCE": ("tools/vergence", "tools/main_vergence.cpp"),
    "VERGENCED": ("daemon/vergenced", "daemon/main_vergenced.c"),
    "VERGENCE_BOARD": ("daemon/vergence-board", "daemon/main_client.c"),
    "SIMRIG": ("tools/simrig/simrig", "tools/simrig/main_simrig.cpp"),
    "SIMRIG_RENDER": ("tools/simrig/simrig-render", "tools/simrig/main_render.cpp"),
}
# What the name or the docstring of a test in Python says if it is for the folder; the longest folder that
# holds a file decides.
WORDS = {
    "calib": "calibrat|touch.up",
    "calib/detect": "calibrat|board in view|board_test|shows the board",
    "calib/zoom": "all zooms",
    "daemon/backends/fault": "fault",
    "daemon/backends/linux": "fake kernel|webcam|Linux",
    "daemon/backends/replay": "replay",
    "daemon/backends/sim": "simulated rig",
    "daemon/backends/store": "settings|flash|update|store",
    "daemon/system": "system_check|update|flash",
    "daemon/client": "client|socket|network",
    "daemon/commands": "console|command",
    "daemon/files": "files|free.space",
    "daemon/images": "view|capture",
    "daemon/install": "install|service",
    "daemon/server": "server/",
    "daemon/session": "record|replay|session",
    "daemon/settings": "settings|profile",
    "daemon/surface": "surface|reconstruct",
    "firmware/console": "console",
    "firmware/device": "instrument|lens|two cameras",
    "firmware/focus": "focus|exposure|brought|bring-up",
    "firmware/rig": "instrument|rig_test|lens|two cameras|exposure",
    "firmware/rig/auto": "focus|exposure",
    "firmware/stereo": "surface|reconstruct",
    "firmware/stereo/zoom": "all zooms",
    "fpga": "process|simulated rig",
    "library": "library_test|python_|wheel",
    "tests/fake_kernel": "fake kernel",
    "tools/host/calibrate": "calibrate",
    "tools/host/calibration_report": "calibration.html",
    "tools/host/capture": "calibrate capture|webcam",
    "tools/host/commands": "command/",
    "tools/host/convert": "export|import|conversion|intact",
    "tools/host/debug": "--debug",
    "tools/host/evaluate": "evaluate",
    "tools/host/fit": "info|python_test",
    "tools/host/formats": "format|input|result",
    "tools/host/info": "info",
    "tools/host/mesh": "mesh",
    "tools/host/page": "report.html|calibration.html|--debug",
    "tools/host/recordings": "export|import|recording",
    "tools/host/report": "report.html",
    "tools/host/view": "live_view",
    "tools/simrig": "simrig",
}
SOURCE = (".c", ".h", ".cpp", ".hpp")
# Parts of programs besides sources: pages, and the Verilog of the simulated bridge.
EMBEDDED = (".html", ".css", ".js", ".v", ".yaml")
# Folders of what is shipped, and of what tests share.
SCANNED = ("calib", "daemon", "firmware", "fpga", "library", "tools", "tests")
INCLUDED_FROM = ("", "firmware/", "daemon/", "tools/", "tools/host/", "tests/", "tests/study/", "fpga/")
# Tests of the tree itself look at every file.
OF_THE_TREE = r"command/(repo_lint|arrows|removal)_test"
MANY = 150
# One test, and all of them one after the other; two or three run at once.
LONG_S, BUDGET_S = 60, 300


def read(path):
    try:
        return (ROOT / path).read_text(encoding="utf-8", errors="replace")
    except (FileNotFoundError, IsADirectoryError):
        return ""


@functools.lru_cache(None)
def files():
    """All files of the tree that have text, by git."""
    listed = slow_tests.git(ROOT, "ls-files", "--cached", "--others", "--exclude-standard", *SCANNED)
    return [path for path in listed if (ROOT / path).is_file()]


@functools.lru_cache(None)
def sources():
    return frozenset(path for path in files() if path.endswith(SOURCE))


@functools.lru_cache(None)
def includes(path):
    """The files of the tree that a source includes."""
    found = []
    for name in re.findall(r'^\s*#\s*include\s+"([^"]+)"', read(path), re.MULTILINE):
        folder = str(pathlib.PurePosixPath(path).parent)
        for start in (folder + "/", *INCLUDED_FROM):
            if start + name in sources():
                found.append(start + name)
                break
    return tuple(found)


@functools.lru_cache(None)
def by_folder():
    folders = collections.defaultdict(list)
    for path in sources():
        folders[str(pathlib.PurePosixPath(path).parent)].append(path)
    return folders


@functools.lru_cache(None)
def implementers(header):
    """The sources in a header's folder that have its name; where there are none, those that include it."""
    path = pathlib.PurePosixPath(header)
    near = [one for one in by_folder()[str(path.parent)] if not one.endswith((".h", ".hpp"))]
    named = [one for one in near if pathlib.PurePosixPath(one).stem.startswith(path.stem)]
    return tuple(named or [one for one in near if header in includes(one)])


def closure(starts):
    """All files that the sources `starts` are made of and linked with."""
    reached, waiting = set(), list(starts)
    while waiting:
        path = waiting.pop()
        if path in reached:
            continue
        reached.add(path)
        waiting += includes(path)
        if path.endswith((".h", ".hpp")):
            waiting += implementers(path)
    return reached


@functools.lru_cache(None)
def program_files(variable):
    return frozenset(closure([PROGRAMS[variable][1]]))


class Test:
    def __init__(self, entry, command, build):
        properties = {one["name"]: one["value"] for one in entry.get("properties", [])}
        self.name = entry["name"]
        self.labels = properties.get("LABELS", [])
        self.setup = properties.get("FIXTURES_SETUP", [])
        self.fixtures = properties.get("FIXTURES_REQUIRED", [])
        self.disabled = properties.get("DISABLED", False)
        self.command = command
        self.build = build
        self.environment = dict(word.split("=", 1) for word in properties.get("ENVIRONMENT", []))

    def script(self):
        """The test's Python file in the tree, or nothing."""
        for word in self.command:
            if word.endswith(".py") or word.endswith("/make"):
                return str(pathlib.Path(word).resolve().relative_to(ROOT))
        return None

    def modules(self):
        """The script, and the modules of the tests that it and they import."""
        places = [pathlib.Path(place).resolve() for place in
                  self.environment.get("PYTHONPATH", "").split(":") if place]
        reached, waiting = [], [self.script()]
        while waiting:
            path = waiting.pop()
            if path in reached:
                continue
            reached.append(path)
            for name in re.findall(r"^\s*(?:from|import)\s+(\w+)", read(path), re.MULTILINE):
                for place in [(ROOT / path).parent, *places]:
                    if (place / f"{name}.py").exists():
                        waiting.append(str((place / f"{name}.py").relative_to(ROOT)))
                        break
        return reached

    def executable(self):
        """The name of the program in the build that is the test, or nothing."""
        first = self.command[0] if self.command else ""
        return first[len(self.build) + 1:] if first.startswith(self.build + "/") else None


def tests_of(build):
    done = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], capture_output=True,
                          text=True, check=True)
    # ctest hides the command of a program that is not built yet.
    commands = {}
    for path in pathlib.Path(build).rglob("CTestTestfile.cmake"):
        for name, words in re.findall(r"^add_test\(\[=\[(.*?)\]=\] (.*)\)$", path.read_text(encoding="utf-8"),
                                      re.MULTILINE):
            commands[name] = re.findall(r'"([^"]*)"', words)
    return [Test(entry, commands.get(entry["name"], []), build) for entry in json.loads(done.stdout)["tests"]]


def commands_of(build):
    """The tree's sources of each executable, from ninja's graph."""
    found = {}
    rules = pathlib.Path(build, "build.ninja").read_text(encoding="utf-8")
    for target, objects in re.findall(r"^build (\S+): C\w*_EXECUTABLE_LINKER\S* ([^|\n]*)", rules, re.MULTILINE):
        paths = [re.sub(r"CMakeFiles/[^/]+\.dir/", "", one)[:-2] for one in objects.split() if one.endswith(".o")]
        found[target] = [path for path in paths if path in sources()]
    return found


def folder_words(path):
    """The words of the longest folder that holds a file; nothing if every test uses it."""
    for folder in pathlib.PurePosixPath(path).parents:
        if str(folder) in WORDS:
            return WORDS[str(folder)]
    return None


def names_in_python(path):
    """How a test in Python names a file other than a source: "board.yaml", or "tools" / "demo"."""
    name = re.escape(pathlib.PurePosixPath(path).name)
    folder = re.escape(pathlib.PurePosixPath(path).parent.name)
    return rf"[\"'/ ]{name}[\"'/ ]" if "." in name else rf"[\"'/]{folder}[\"'/, ]+{name}\b"


def reason_in_python(test, paths):
    """Why the change of `paths` can break a test in Python, or nothing."""
    modules = test.modules()
    for path in paths:
        if path in modules:
            return path
    own = read(modules[0])
    for path in paths:
        if path in own or (not path.endswith(SOURCE) and re.search(names_in_python(path), own)):
            return path
    text = "".join(read(path) for path in modules)
    used = [variable for variable in PROGRAMS if re.search(rf"\b{variable}\b", text)]
    about = f"{test.name} {' '.join((ast.get_docstring(ast.parse(own)) or '').split())}"
    for path in paths:
        words = folder_words(path)
        if path.startswith("tests/"):
            linked = path.endswith(SOURCE) and words is not None
        else:
            linked = path.endswith(EMBEDDED) or any(path in program_files(one) for one in used)
        if linked and (words is None or re.search(words, about)):
            return path
    return None


def reason_in_c(test, paths, programs):
    """Why the change of `paths` can break a test in C++, or nothing."""
    reached = closure(programs.get(test.executable(), []))
    own = {path for path in reached if path.startswith("tests/")}
    if "fpga" in test.labels:
        reached |= {path for path in paths if path.startswith("fpga/")}
    elif "quick" not in test.labels:
        # Slow ones only for the folders that they are about: those that they include themselves.
        about = own | {found for path in own for found in includes(path)}
        folders = {pathlib.PurePosixPath(path).parent for path in about}
        reached = {path for path in reached if pathlib.PurePosixPath(path).parent in folders}
    if any("SIMRIG" in read(path) for path in own):
        reached |= program_files("SIMRIG") | {path for path in paths if path.startswith("fpga/rtl")}
    return next((path for path in paths if path in reached), None)


def reasons(build, paths):
    """{test: a changed file that can break it}."""
    programs = commands_of(build)
    found = {}
    for test in tests_of(build):
        if test.disabled or test.setup:
            continue
        if re.fullmatch(OF_THE_TREE, test.name):
            found[test.name] = "any file"
        elif test.script():
            reason = reason_in_python(test, paths)
            if test.name == "command/readme_test":  # reads the READMEs and runs the tools
                reason = next((path for path in paths if path.endswith(".md") or path.startswith("tools/")), reason)
            if reason:
                found[test.name] = reason
        else:
            reason = reason_in_c(test, paths, programs)
            if reason:
                found[test.name] = reason
    return found


def seconds_of(build):
    """What each test took when it was last run, as far as ctest has noted it."""
    path = pathlib.Path(build, "Testing", "Temporary", "CTestCostData.txt")
    lines = path.read_text(encoding="utf-8").split("---")[0].splitlines() if path.exists() else []
    return {name: float(cost) for name, _, cost in (line.split(" ") for line in lines if line.count(" ") == 2)}


def explain(base, paths, found, left, known):
    """What will be run and why, before anything is built."""
    lines = [f"since {base[:8]}: {len(paths)} changed files, {len(found)} tests can break"]
    by_reason = collections.Counter(found.values()).most_common()
    lines += [f"  {count:4} by {reason}" for reason, count in by_reason[:8]]
    if len(by_reason) > 8:
        lines.append(f"       and others by {len(by_reason) - 8} more files")
    lines.append(f"  together {sum(known.get(name, 0) for name in found):.0f} s, as far as they have been run here")
    if len(found) > MANY:
        lines.append("  most of the tree needs what has changed: this takes longer than a change in one folder")
    if left:
        lines.append("left to tools/test, because they take long or rarely break: " + " ".join(left))
    return "\n".join(lines) + "\n"


def left_out(found, known):
    """Those that take longer than a run between two commits may. A test that is itself changed is run."""
    chosen = [name for name, reason in found.items() if not reason.startswith("tests/")]
    left = {name for name in chosen if known.get(name, 0) > LONG_S or re.search(slow_tests.exclude(), name)}
    total_s = 0
    for name in sorted(set(chosen) - left, key=lambda name: (known.get(name, 0), name)):
        total_s += known.get(name, 0)
        if total_s > BUDGET_S:
            left.add(name)
    return sorted(left)


def changed_tests(build, base=None):
    """Their names; without those that take long, which are named."""
    base = base or slow_tests.base_of(ROOT)
    paths = slow_tests.changed(ROOT, base)
    known = seconds_of(build)
    found = reasons(build, paths)
    left = left_out(found, known)
    found = {name: reason for name, reason in found.items() if name not in left}
    sys.stderr.write(explain(base, paths, found, left, known))
    return sorted(found)


def targets(build, names):
    """Of ninja, for the tests whose name matches, with those that prepare for them."""
    every = tests_of(build)
    chosen = [test for test in every if re.search(names, test.name)]
    needed = {fixture for test in chosen for fixture in test.fixtures}
    chosen += [test for test in every if needed & set(test.setup)]
    rules = re.findall(r"^build ([^:|]+?)(?: \|[^:]*)?: ", pathlib.Path(
        build, "build.ninja").read_text(encoding="utf-8"), re.MULTILINE)
    every_target = {target for rule in rules for target in rule.split()}
    found = set()
    for test in chosen:
        text = "".join(read(path) for path in test.modules()) if test.script() else None
        if text and re.search("completion|manual", text):
            found |= {"daemon_manuals", "tools_manuals"}
        # Programs that a test finds beside one that it is given.
        if text and re.search(r"\bBUILD\b|\.parents\[1\]|parent\.parent", text):
            found |= {target for target, _ in PROGRAMS.values()}
        if text and "simrig-render" in text:
            found.add(PROGRAMS["SIMRIG_RENDER"][0])
        for name, value in [("", word) for word in test.command] + list(test.environment.items()):
            # Every test gets the same variables; it has those that it names.
            if name and text is not None and not re.search(rf"\b{name}\b", text):
                continue
            if value == build:
                found |= {target for target, _ in PROGRAMS.values()}
            elif value.startswith(build + "/"):
                found.add(value[len(build) + 1:])
    return sorted(found & every_target)


def main(words):
    if words[:1] == ["--changed"] and len(words) in (2, 3):
        print("\n".join(changed_tests(*words[1:])))
    elif words[:1] == ["--matching"] and len(words) == 4:
        for test in tests_of(words[1]):
            quick, sanitized = "quick" in test.labels, "sanitize" in test.labels
            part = {"quick": quick, "sanitize": quick or sanitized, "release": not (quick or sanitized)}
            if re.search(words[2], test.name) and part[words[3]]:
                print(test.name)
    elif words[:1] == ["--targets"] and len(words) == 3:
        print("\n".join(targets(*words[1:])))
    else:
        print(__doc__, end="")
        return 0 if words == ["--help"] else 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
