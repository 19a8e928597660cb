# SPDX-License-Identifier: Apache-2.0
"""`vergence info` on a calibration of all zooms: its page, any state of it as one text or in the files
of other programs, lens tables, and what is refused."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest
import zlib

VERGENCE = os.environ["VERGENCE"]
TEXT = subprocess.run([os.environ["VERGENCE_ZOOM_RIG"]], capture_output=True, check=True).stdout


class ZoomInfo(unittest.TestCase):
    def setUp(self):
        self.here = tempfile.mkdtemp(prefix="vergence-zoom-")
        self.addCleanup(shutil.rmtree, self.here)
        self.zoom = self.path("instrument.zoom")
        with open(self.zoom, "wb") as file:
            file.write(TEXT)

    def path(self, name):
        return os.path.join(self.here, name)

    def info(self, *arguments):
        return subprocess.run([VERGENCE, "info", *arguments], capture_output=True, text=True,
                              timeout=120)

    def works(self, *arguments):
        done = self.info(*arguments, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)[0]

    def refused(self, *arguments, words):
        done = self.info(*arguments)
        self.assertNotEqual(done.returncode, 0, done.stdout)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)

    @staticmethod
    def rewrite(path, lines):
        """Writes a calibration with the right checksum."""
        body = "\n".join(lines) + "\n"
        with open(path, "w", encoding="ascii") as file:
            file.write(body + f"crc32 {zlib.crc32(body.encode('ascii')):08x}\n")

    def test_page(self):
        page = self.works(self.zoom)
        self.assertEqual(page["kind"], "calibration of all zooms")
        focal = page["left"]["focal_length"]
        self.assertAlmostEqual(focal[0]["focal_px"] * 0.0032, 8.5, delta=0.02)
        self.assertAlmostEqual(focal[-1]["focal_px"] * 0.0032, 85, delta=0.05)
        # A count is 1.6 % of f at 1x; the motor's sigma is one count and a quarter.
        self.assertAlmostEqual(focal[0]["motor_sigma"], 0.0165, delta=0.003)
        self.assertGreater(page["depth_sigma"][1]["pan_mm"], 50)
        self.assertEqual(self.info(self.here).returncode, 0)  # known by its name in a directory

    def test_a_state(self):
        text = self.path("rig.txt")
        page = self.works(self.zoom, "--at", "zoom=421,distance=1800", "--convert", text)
        self.assertAlmostEqual(page["vergence_depth_mm"], 1800, delta=100)
        with open(text, encoding="ascii") as file:
            self.assertIn("axes_in_sigma yes\n", file.read())
        again = self.works(text)
        self.assertEqual(page["left"], again["left"])
        self.assertEqual(page["crc32"], again["crc32"])
        for number, form in enumerate(("opencv", "ros", "kalibr", "mrcal")):
            self.works(self.zoom, "--at", "zoom=850,focus=600,left_pan=3,right_pan=-4.5",
                       "--export", form, "--out", self.path(f"out{number}"))

    def test_tables(self):
        page = self.works(self.zoom, "--export", "gyroflow", "--out", self.path("gyroflow"))
        self.assertIn("focus", page["loss"])
        with open(self.path("gyroflow/left.json"), encoding="ascii") as file:
            table = json.load(file)
        at = {float(name): one for name, one in table["interpolations"].items()}
        self.assertEqual(len(at), 25)
        self.assertAlmostEqual(min(at), 8.5, delta=0.02)
        self.assertAlmostEqual(max(at), 85, delta=0.05)
        widest = at[min(at)]
        self.assertAlmostEqual(widest["camera_matrix"][0][0], min(at) / 0.0032, delta=1)
        self.assertLess(widest["distortion_coeffs"][0], 0)
        self.works(self.zoom, "--export", "opentrackio", "--out", self.path("opentrackio"))
        with open(self.path("opentrackio/right.json"), encoding="ascii") as file:
            samples = json.load(file)
        first, last = samples[0]["lens"], samples[-1]["lens"]
        self.assertEqual(first["encoders"], {"focus": 0, "zoom": 0})
        self.assertEqual(first["distortion"][0]["model"], "Brown-Conrady U-D")
        self.assertAlmostEqual(last["entrancePupilOffset"], 0.0244, delta=1e-4)
        self.assertAlmostEqual(last["focusDistance"], 0.8, delta=0.01)

    def test_the_documented_commands(self):
        with open(os.path.join(os.environ["VERGENCE_SOURCE"], "firmware/stereo/zoom/README.md"),
                  encoding="utf-8") as file:
            block = file.read().split("```sh\n")[1].split("```")[0]
        programs = os.path.dirname(VERGENCE) + os.pathsep + os.environ["PATH"]
        for line in block.splitlines():
            done = subprocess.run(["bash", "-c", line], cwd=self.here, capture_output=True,
                                  text=True, timeout=120, env={**os.environ, "PATH": programs})
            self.assertEqual(done.returncode, 0, line + done.stderr)

    def test_refusals(self):
        self.refused(self.zoom, "--at", "zoom=900,distance=1800", words=("left zoom", "900", "850"))
        self.refused(self.zoom, "--at", "zoom=421", words=("focus is missing",))
        self.refused(self.zoom, "--at", "zoom=421,distance=1800,iris=4", words=('"iris"',))
        self.refused(self.zoom, "--at", "zoom=421,distance=300", words=("cannot turn",))
        self.refused(self.zoom, "--at", "nowhere", words=("nowhere", "session"))
        self.refused(self.zoom, "--convert", self.path("x"), words=("--at",))
        self.refused(self.zoom, "--export", "ros", "--out", self.path("x"), words=("--at",))
        one = self.path("one.txt")
        self.works(self.zoom, "--at", "zoom=421,distance=1800", "--convert", one)
        self.refused(one, "--export", "gyroflow", "--out", self.path("x"), words=("all zooms",))
        self.refused(one, "--at", "zoom=421,distance=1800", words=("all zooms",))
        damaged = self.path("damaged")
        with open(damaged, "wb") as file:
            file.write(TEXT.replace(b"left_focal ", b"left_focal 1"))
        self.refused(damaged, words=("damaged", "checksum"))
        with open(damaged, "wb") as file:
            file.write(TEXT[:len(TEXT) // 2])
        self.refused(damaged, words=("damaged",))
        lines = TEXT.decode("ascii").splitlines()[:-1]
        at = next(i for i, line in enumerate(lines) if line.startswith("right_position_mm "))
        self.rewrite(damaged, lines[:at] + ["right_position_mm 0.000000000 0.000000000 0.000000000"] + lines[at + 1:])
        self.refused(damaged, words=("right_position_mm", "same place"))
        # Of three parameters each nearly opposite to the two others.
        first = next(i for i, line in enumerate(lines) if line.startswith("sigma "))
        rows = [line.split(" ") for line in lines[first:first + 3]]
        for row in rows:
            row[1:] = ["1.000000000000"] + ["-0.900000000000"] * (len(row) - 2)
        self.rewrite(damaged, lines[:first] + [" ".join(row) for row in rows] + lines[first + 3:])
        self.refused(damaged, words=("covariance is impossible", "calibrate again"))
        self.assertFalse(os.path.exists(self.path("x")))
        images = [os.path.join(self.here, f"{side}.pgm") for side in ("left", "right")]
        for image in images:
            with open(image, "wb") as file:
                file.write(b"P5 64 64 255\n" + bytes(64 * 64))
        done = subprocess.run([VERGENCE, "reconstruct", *images, "--calibration", self.zoom, "--out",
                               self.path("surface")], capture_output=True, text=True, timeout=120)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("all zooms", done.stderr)


if __name__ == "__main__":
    unittest.main()
