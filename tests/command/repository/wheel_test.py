# SPDX-License-Identifier: Apache-2.0
"""The source package and the wheel: what the source package holds suffices to build and install the Python
package, with an empty home and without this build's folders."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import package


class Wheel(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vergence-wheel-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.home = self.folder / "home"
        self.home.mkdir()

    def run_clean(self, *words, cwd=None):
        """In an environment that has nothing of ours but the network's settings."""
        kept = {name: value for name, value in os.environ.items()
                if name.upper().startswith(("PIP_", "SSL_", "REQUESTS_")) or name.upper().endswith("_PROXY")}
        done = subprocess.run([str(word) for word in words], cwd=cwd or self.folder, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              env={**kept, "HOME": str(self.home), "PATH": "/usr/bin:/bin",
                                   "CMAKE_BUILD_PARALLEL_LEVEL": str(os.cpu_count())})
        self.assertEqual(done.returncode, 0, done.stdout[-4000:])
        return done.stdout

    def test_the_source_package_builds_and_installs(self):
        backend = "from scikit_build_core.build import build_sdist as b; print(b({!r}))"
        made = self.folder / "made"
        self.run_clean(package.tools(), "-c", backend.format(str(made)), cwd=package.SOURCE)
        source = next(made.glob("vergence-*.tar.gz"))
        self.assertLess(source.stat().st_size, 8e6)
        self.run_clean("/usr/bin/python3", "-m", "venv", "--system-site-packages", self.folder / "venv")
        python = self.folder / "venv/bin/python3"
        self.run_clean(python, "-m", "pip", "install", "--no-cache-dir", source)
        printed = self.run_clean(python, "-c", "import vergence as v; print(v.__version__, v.__file__)")
        self.assertIn(str(self.folder / "venv"), printed)
        files = {path.name for path in (self.folder / "venv").glob("lib/python3*/site-packages/vergence/*")}
        self.assertLessEqual({"py.typed", "_vergence.pyi", "_surface.py"}, files)
        left = [str(one) for one in self.folder.glob("venv/bin/vergence*")]
        self.assertEqual(left, [])  # programs are installed by cmake


if __name__ == "__main__":
    unittest.main()
