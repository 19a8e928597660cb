# SPDX-License-Identifier: Apache-2.0
"""The figures of tools/lint. Each takes the tree and returns its value and the places that count."""
import collections
import os
import re
import shutil
import subprocess

import phrases

SIX = ("firmware", "daemon", "calib", "tools", "tests", "fpga")
CODE = (".c", ".h", ".cpp", ".hpp")
TEXTS = CODE + (".py", ".sh", ".md", ".txt", ".cmake", ".js", ".css", ".html", ".v", ".rdl", ".service",
                ".rules", ".yaml", ".conf", ".json")
# Data, the list of forbidden phrases with its test, and the names of assertions and mutants, which
# are part of what is proved.
NOT_PROSE = re.compile(r"/corpus/|/generated/|^tests/sessions/.*/|^tools/lint\.d/phrases\.py$|"
                       r"^LICENSE$|^fpga/figures/|^fpga/formal/.*\.(json|v)$")
# Of the RTL and its proofs each module has a file of its own, which Verilator and yosys look for in one
# folder.
NOT_SOURCE = re.compile(r"^fpga/(rtl|formal)/|/corpus/|/generated/|^tests/sessions/|/pictures(/|$)|^tests/data/")
# One text compiled for four instruction sets; their branches are those of the algorithm.
KERNELS = re.compile(r"^firmware/stereo/match/kernels")
MAX_BRANCHES = 12
MAX_FILES = 30
LONG_FILE = 400


class Tree:
    """The files of a checkout, as git knows them, or by walking where there is no git."""

    def __init__(self, root):
        self.root = root
        try:
            listed = subprocess.run(["git", "-c", "safe.directory=*", "-C", root, "ls-files", "-co",
                                     "--exclude-standard"], capture_output=True, text=True,
                                    check=True).stdout.splitlines()
        except (OSError, subprocess.CalledProcessError):
            listed = [os.path.relpath(os.path.join(folder, name), root)
                      for folder, _, names in os.walk(root) for name in names
                      if "/.git/" not in folder + "/"]
        self.files = sorted({path for path in listed if os.path.isfile(os.path.join(root, path))})
        self.texts = {}

    def text(self, path):
        if path not in self.texts:
            with open(os.path.join(self.root, path), encoding="utf-8", errors="replace") as file:
                self.texts[path] = file.read()
        return self.texts[path]

    def is_prose(self, path):
        if NOT_PROSE.search(path):
            return False
        return path.endswith(TEXTS) or os.path.basename(path) == "CMakeLists.txt" or (
            "." not in os.path.basename(path) and self.text(path).startswith("#!"))


def forbidden_phrases(tree):
    places = [f'{path}:{number}: "{found}" ({instead})'
              for path in tree.files if tree.is_prose(path)
              for number, found, instead in phrases.found_in(tree.text(path))]
    return len(places), places


def flat_files(tree):
    """Files of the largest folder of sources; the places are all folders above MOST_FILES."""
    folders = collections.Counter(os.path.dirname(path) for path in tree.files
                                  if not NOT_SOURCE.search(path))
    largest = folders.most_common(1)[0][1] if folders else 0
    return largest, [f"{folder}/: {count} files" for folder, count in folders.most_common()
                     if count > MAX_FILES]


def long_files(tree):
    """Sources of more lines than LONG_FILE: to be split by subject, where there are two."""
    places = [f"{path}: {tree.text(path).count(chr(10))} lines" for path in tree.files
              if path.endswith(CODE + (".py",)) and tree.text(path).count("\n") > LONG_FILE]
    return len(places), places


def includes(tree):
    """File -> (file that it includes, line)."""
    known, graph = set(tree.files), {}
    for path in tree.files:
        if not path.endswith(CODE):
            continue
        bases = (os.path.dirname(path), "", *SIX, "tools/host", "fpga/generated")
        graph[path] = {}
        for number, line in enumerate(tree.text(path).splitlines(), 1):
            match = re.match(r'\s*#\s*include\s+"([^"]+)"', line)
            for base in bases if match else ():
                target = os.path.normpath(os.path.join(base, match[1]))
                if target in known:
                    graph[path].setdefault(target, number)
                    break
    return graph


def circles_of(graph):
    """Sets of files that include each other (Tarjan's strongly connected components)."""
    index, low, stack, on_stack, found = {}, {}, [], set(), []
    for start in graph:
        if start in index:
            continue
        work = [(start, iter(graph[start]))]
        index[start] = low[start] = len(index)
        stack.append(start)
        on_stack.add(start)
        while work:
            node, targets = work[-1]
            for target in targets:
                if target not in index:
                    index[target] = low[target] = len(index)
                    stack.append(target)
                    on_stack.add(target)
                    work.append((target, iter(graph.get(target, ()))))
                    break
                if target in on_stack:
                    low[node] = min(low[node], index[target])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    group = set()
                    while node not in group:
                        group.add(stack.pop())
                    on_stack -= group
                    if len(group) > 1 or node in graph.get(node, ()):
                        found.append(sorted(group))
    return found


def include_circles(tree):
    graph = includes(tree)
    circles = circles_of(graph)
    return len(circles), [f"{path}:{line}: includes {target} in a circle"
                          for circle in circles for path in circle
                          for target, line in graph[path].items() if target in circle]


def module_circles(tree):
    """As include_circles, where a header and the source of its name are one."""
    modules = {}
    for path, targets in includes(tree).items():
        module = os.path.splitext(path)[0]
        for target, line in targets.items():
            if not path.startswith("tests/") and os.path.splitext(target)[0] != module:
                modules.setdefault(module, {}).setdefault(os.path.splitext(target)[0], (path, line))
    circles = circles_of({module: list(targets) for module, targets in modules.items()})
    return len(circles), [f"{path}:{line}: includes {target}.h* in a circle of {len(circle)} modules"
                          for circle in circles for module in circle
                          for target, (path, line) in modules.get(module, {}).items()
                          if target in circle]


def folders_without_readme(tree):
    missing = [folder for folder in SIX if f"{folder}/README.md" not in tree.files]
    return len(missing), [f"{folder}/: no README.md" for folder in missing]


def complex_functions(tree):
    sources = [path for path in tree.files if path.endswith((".c", ".cpp"))
               and not path.startswith("tests/") and not KERNELS.search(path)
               and not NOT_SOURCE.search(path)]
    if not sources:
        return 0, []
    if not shutil.which("pmccabe"):
        raise OSError("pmccabe is missing (tools/install_packages test)")
    done = subprocess.run(["pmccabe", *sources], cwd=tree.root, capture_output=True, text=True)
    places = []
    for line in done.stdout.splitlines():
        # Complexity where a switch counts once, complexity, statements, first line, lines, place
        fields = line.split("\t")
        match = re.fullmatch(r"(.+)\(\d+\): (.*)", fields[-1])
        if match and int(fields[0]) > MAX_BRANCHES:
            places.append((int(fields[0]), f"{match[1]}:{fields[3]}: {match[2]} has {fields[0]} branches"))
    return len(places), [place for _, place in sorted(places, reverse=True)]


def bytes_of_sessions(tree):
    """Of what was recorded, and of the references of tools/regress."""
    blobs = [path for path in tree.files if re.match(r"tests/(data/)?sessions/.*/", path)]
    sizes = {path: os.path.getsize(os.path.join(tree.root, path)) for path in blobs}
    return sum(sizes.values()), [f"{path}: {size} bytes" for path, size in
                                 sorted(sizes.items(), key=lambda item: -item[1])]


def git(tree, *words):
    done = subprocess.run(["git", "-c", "safe.directory=*", "-C", tree.root, *words],
                          capture_output=True, text=True)
    return done.stdout.splitlines() if done.returncode == 0 else []


def commit_subjects(tree):
    """Of the commits since the last release (a tag v*); without one since the main branch, and on the main
    branch itself of the last one."""
    log = ("log", "--no-merges", "--format=%h %s")
    commits = []
    for base in git(tree, "describe", "--tags", "--abbrev=0", "--match", "v[0-9]*") + [
            "origin/HEAD", "origin/main", "main"]:
        commits = commits or git(tree, *log, f"{base}..HEAD")
    commits = commits or git(tree, *log, "-1")
    places = []
    for line in commits:
        commit, _, subject = line.partition(" ")
        fault = phrases.fault_of_subject(subject)
        if fault:
            places.append(f'{commit}: "{subject}" {fault}')
    return len(places), places
