# SPDX-License-Identifier: Apache-2.0
"""libvergence: a C program that finds it by pkg-config or CMake in an install tree measures a pair."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from pairs import Fixture, RECTIFIED
from pairs import run as run_vergence

BUILD = pathlib.Path(os.environ["VERGENCE_LIBRARY"]).parents[1]

PROGRAM = r"""
#include <stdio.h>
#include <stdlib.h>
#include <vergence.h>

static int fail(const struct vergence_error *error) {
    fprintf(stderr, "%s: %s\n", vergence_error_name(error->code), error->text);
    return 3;
}

int main(int argc, char **argv) {
    const char *const files[] = {"--files", "disparity.pfm,mesh.ply", NULL};
    struct vergence_error error;
    struct vergence_value depth_mm;
    struct vergence_plane plane;
    vergence_result *result;
    if (argc < 4 || vergence_reconstruct_files(argv[1], argv[2], NULL, (const char *const *)argv + 4, NULL,
                                               &result, &error) != 0) {
        return fail(&error);
    }
    if (vergence_result_depth(result, 30, 20, &depth_mm, &error) != 0 ||
        vergence_result_plane(result, NULL, &plane, &error) != 0 ||
        vergence_result_write(result, argv[3], files, NULL, &error) != 0) {
        return fail(&error);
    }
    printf("%.1f %.3f %.1f %zu\n", depth_mm.value, depth_mm.sigma, plane.distance_mm.value, plane.used);
    vergence_result_free(result);
    return 0;
}
"""
CMAKE = """cmake_minimum_required(VERSION 3.25)
project(user LANGUAGES C)
find_package(vergence 0.1 REQUIRED)
add_executable(user user.c)
target_link_libraries(user PRIVATE vergence::vergence)
"""


class Library(Fixture):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vergence-library-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.prefix = cls.folder / "moved"
        # The tree works where it is moved to.
        install = ["cmake", "--install", BUILD, "--prefix", cls.folder / "prefix", "--component"]
        for command in ([*install, "library"], [*install, "development"], ["mv", cls.folder / "prefix", cls.prefix]):
            subprocess.run(command, check=True, capture_output=True)
        cls.libraries = next(cls.prefix.glob("lib*/**/libvergence.so")).parent
        cls.environment = {**os.environ, "PKG_CONFIG_PATH": str(cls.libraries / "pkgconfig")}
        (cls.folder / "user.c").write_text(PROGRAM)
        flags = subprocess.run(["pkg-config", "--cflags", "--libs", "vergence"], check=True, text=True,
                               capture_output=True, env=cls.environment).stdout.split()
        subprocess.run(["gcc", "-std=c11", "-Wall", "-Wextra", "-Wstrict-prototypes", "-pedantic", "-Werror",
                        cls.folder / "user.c", *flags, f"-Wl,-rpath,{cls.libraries}", "-o", cls.folder / "user"],
                       check=True)

    def use(self, *words, program=None):
        return subprocess.run([program or self.folder / "user", *map(str, words)], capture_output=True, text=True)

    def test_it_writes_the_bytes_of_the_command(self):
        done = self.use(self.left_path, self.right_path, self.out, *RECTIFIED)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        depth_mm, sigma_mm, distance_mm, used = map(float, done.stdout.split())
        self.assertAlmostEqual(depth_mm, 500 * 100 / 12, delta=4 * sigma_mm)
        self.assertAlmostEqual(distance_mm, 500 * 100 / 12, delta=30)
        self.assertGreater(used, 10000)
        other = self.directory / "other"
        run_vergence("reconstruct", self.left_path, self.right_path, *RECTIFIED, "--files",
                     "disparity.pfm,mesh.ply", "--out", other)
        for name in ("disparity.pfm", "mesh.ply"):
            self.assertEqual((self.out / name).read_bytes(), (other / name).read_bytes(), name)

    def test_errors_have_the_words_of_the_command(self):
        for words in ([], ["--rectified", "--near", 5], ["--rectified", "--preset", "x"],
                      ["--rectified", "--files", "mesh.obj"], ["--calibration", self.left_path]):
            done = self.use(self.left_path, self.right_path, self.out, *words)
            command = run_vergence("reconstruct", self.left_path, self.right_path, "--out", self.out, *words)
            with self.subTest(words):
                self.assertEqual(done.returncode, 3)
                reason = done.stderr.split(": ", 1)[1].strip()
                self.assertEqual(command.stderr.split(": ", 1)[1].split("; see")[0].strip(), reason)
                self.assertFalse(self.out.exists())

    def test_cmake_finds_it(self):
        (self.folder / "CMakeLists.txt").write_text(CMAKE)
        made = self.folder / "made"
        for words in (["cmake", "-S", self.folder, "-B", made, f"-DCMAKE_PREFIX_PATH={self.prefix}"],
                      ["cmake", "--build", made]):
            subprocess.run(words, check=True, capture_output=True)
        done = self.use(self.left_path, self.right_path, self.out, *RECTIFIED, program=made / "user")
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_only_its_functions_are_visible(self):
        done = subprocess.run(["nm", "--dynamic", "--defined-only", self.libraries / "libvergence.so"],
                              check=True, capture_output=True, text=True)
        names = [line.split()[-1] for line in done.stdout.splitlines() if " A " not in line]
        self.assertGreater(len(names), 30)
        self.assertEqual([name for name in names if not name.endswith("@@VERGENCE_1")
                          or not name.startswith("vergence_")], [])
        header = (self.prefix / "include/vergence.h").read_text()
        self.assertEqual([name for name in names if name.split("@")[0] + "(" not in header], [])


if __name__ == "__main__":
    unittest.main()
