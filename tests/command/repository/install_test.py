# SPDX-License-Identifier: Apache-2.0
"""`cmake --install` into an empty prefix gives a user everything: the demo's quick path runs from
there."""
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

from pairs import VERGENCE

ROOT = os.environ["VERGENCE_SOURCE"]
BUILD = os.path.dirname(os.path.dirname(VERGENCE))
HAS_RIG = os.path.exists(os.path.join(BUILD, "tools", "simrig", "simrig"))
TIMEOUT_S = 300


def install(prefix, **environment):
    subprocess.run(["cmake", "--install", BUILD, "--prefix", prefix], check=True, timeout=TIMEOUT_S,
                   capture_output=True, env={**os.environ, **environment})


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="vergence-install-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        cls.prefix = os.path.join(folder.name, "prefix")
        install(cls.prefix)
        cls.environment = {**os.environ, "PATH": f"{cls.prefix}/bin:/usr/bin:/bin"}

    def run_installed(self, *words, **options):
        return subprocess.run(words, capture_output=True, text=True, timeout=TIMEOUT_S,
                              cwd=self.folder, env=self.environment, **options)

    def test_all_of_it_is_there(self):
        files = ["bin/vergence", "bin/vergenced", "etc/vergence/vergenced.conf",
                 "etc/vergence/profiles/two-cameras.profile", "lib/systemd/system/vergenced.service",
                 "lib/sysusers.d/vergence.conf", "lib/udev/rules.d/70-vergence.rules",
                 "share/bash-completion/completions/vergence",
                 "share/bash-completion/completions/vergenced", "share/doc/vergence/LICENSE",
                 "share/doc/vergence/README.md", "share/man/man1/vergence-reconstruct.1",
                 "share/man/man5/vergenced.conf.5", "share/man/man8/vergenced.8"]
        if HAS_RIG:
            files += ["bin/simrig", "share/vergence/scenes/still_life.yaml",
                      "share/vergence/rigs/default.yaml"]
            for name in ("simrig", "simrig-control", "simrig-compare"):
                files += [f"bin/{name}", f"share/man/man1/{name}.1"]
                for option, word in (("--help", f"usage: {name} "), ("--version", f"{name} ")):
                    done = self.run_installed(name, option)
                    self.assertEqual((done.returncode, done.stderr), (0, ""))
                    self.assertTrue(done.stdout.startswith(word), done.stdout)
        for name in files:
            self.assertTrue(os.path.isfile(os.path.join(self.prefix, name)), name)

    def test_nothing_of_the_build_is_needed(self):
        for name in sorted(os.listdir(os.path.join(self.prefix, "bin"))):
            path = os.path.join(self.prefix, "bin", name)
            libraries = self.run_installed("ldd", path).stdout
            self.assertNotIn("not found", libraries)
            self.assertNotIn(BUILD, libraries)
            self.assertNotRegex(self.run_installed("readelf", "-d", path).stdout, "RPATH|RUNPATH")

    def test_help_is_found(self):
        page = self.run_installed("man", "-M", f"{self.prefix}/share/man", "vergence-info")
        self.assertEqual(page.returncode, 0, page.stderr)
        self.assertIn("vergence info", page.stdout)
        for name in ("vergence", "vergenced"):
            script = f"{self.prefix}/share/bash-completion/completions/{name}"
            done = self.run_installed("bash", "-c", f"source {script}; complete -p {name}")
            self.assertIn("_vergence", done.stdout)

    def test_the_service_is_below_the_prefix(self):
        unit = os.path.join(self.prefix, "lib", "systemd", "system", "vergenced.service")
        with open(unit, encoding="utf-8") as file:
            text = file.read()
        settings = f"{self.prefix}/etc/vergence/vergenced.conf"
        self.assertIn(f"\nExecStart={self.prefix}/bin/vergenced --config {settings}\n", text)
        self.assertEqual(self.run_installed("vergenced", "--check", settings).returncode, 0)
        self.assertTrue(shutil.which("systemd-analyze"), "package to install: systemd")
        done = self.run_installed("systemd-analyze", "verify", "--man=no", unit)
        self.assertEqual([line for line in done.stderr.splitlines() if "vergenced.service" in line],
                         [])

    def test_a_second_time_settings_stay(self):
        root = os.path.join(self.folder, "root")
        settings = os.path.join(root, "usr/local/etc/vergence/vergenced.conf")
        install("/usr/local", DESTDIR=root)
        with open(settings, "a", encoding="utf-8") as file:
            file.write("# mine\n")
        install("/usr/local", DESTDIR=root)
        with open(settings, encoding="utf-8") as file:
            self.assertTrue(file.read().endswith("# mine\n"))
        unit = os.path.join(root, "usr/local/lib/systemd/system/vergenced.service")
        with open(unit, encoding="utf-8") as file:
            self.assertIn("\nExecStart=/usr/local/bin/vergenced ", file.read())

    def test_the_readme_s_commands_are_these(self):
        with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
            block = re.search(r"^```sh install\n(.*?)^```", file.read(), re.S | re.M)[1]
        # The build of this test replaces the demo's; nothing goes into the system.
        home = os.path.join(self.folder, "home")
        os.mkdir(home)
        lines = [line for line in block.splitlines() if line.startswith("cmake --install ")]
        self.assertGreaterEqual(len(lines), 2)
        for line in lines:
            line = line.replace('"$(tools/build --where demo)"', BUILD)
            self.assertIn(BUILD, line)
            done = self.run_installed("env", f"DESTDIR={self.folder}/stage", f"HOME={home}", "bash",
                                      "-ec", line)
            self.assertEqual(done.returncode, 0, done.stderr)
        for prefix in ("/usr/local", f"{home}/.local"):
            self.assertTrue(os.path.isfile(f"{self.folder}/stage{prefix}/bin/vergence"), prefix)

    @unittest.skipUnless(HAS_RIG, "the simulated rig is not built (VERGENCE_FPGA)")
    def test_the_demo_runs_from_there(self):
        out = os.path.join(self.folder, "results")
        done = self.run_installed(os.path.join(ROOT, "tools", "demo"), "--quick", "--installed",
                                  self.prefix, "--out", out)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertNotIn("building", done.stdout)
        with open(os.path.join(out, "motorcycle", "evaluation.json"), encoding="utf-8") as file:
            self.assertLess(json.load(file)["measured_all"]["bad_2_percent"], 6)
        with open(os.path.join(out, "rig_cylinder", "measured.json"), encoding="utf-8") as file:
            found = json.load(file)
        self.assertGreaterEqual(found["visible_textured"]["measured_percent"], 90)
        self.assertLessEqual(found["visible"]["fit"]["wrong_3px_percent"], 1)

    @unittest.skipUnless(HAS_RIG, "the simulated rig is not built (VERGENCE_FPGA)")
    def test_scenes_are_those_of_the_prefix(self):
        """The rig that `vergence simulate` starts opens no file of the sources or the build,
        either."""
        self.assertTrue(shutil.which("strace"), "package to install: strace")
        log = os.path.join(self.folder, "calls")
        done = self.run_installed("strace", "-f", "-e", "trace=%file", "-o", log, "vergence",
                                  "simulate", "plane", "--view", "view")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        with open(log, encoding="utf-8", errors="replace") as file:
            calls = file.read()
        self.assertIn(f'"{self.prefix}/share/vergence/scenes/plane.yaml"',
                      calls.replace("/bin/../", "/"))
        for place in (ROOT, BUILD):
            self.assertFalse(f'"{place}' in calls, place)


if __name__ == "__main__":
    unittest.main()
