# SPDX-License-Identifier: Apache-2.0
"""Poor surfaces with causes visible in the pictures: light, blur, aim; and swapped or mirrored
pictures. On synthetic pairs, and on recorded scenes of a simulated rig."""
import json
import os
import pathlib
import shutil
import unittest
import zlib

import cv2
import numpy

import pairs

SESSIONS = pathlib.Path(os.environ["VERGENCE_SESSIONS"])
WHITE = 1023
# Share of the incoming light, and of the sensor's pedestal.
PEDESTAL = 42


def exposed(image, gain, random):
    light = (image.astype(float) - PEDESTAL) * gain + PEDESTAL + random.normal(0, 1, image.shape)
    return numpy.clip(numpy.round(light), 0, WHITE).astype(numpy.uint16)


def blurred(image, sigma_px):
    """Each colour of the mosaic separately."""
    soft = image.astype(numpy.float32)
    for row in (0, 1):
        for column in (0, 1):
            part = soft[row::2, column::2]
            soft[row::2, column::2] = cv2.GaussianBlur(part, (0, 0), sigma_px / 2)
    return soft


class Session:
    """A recorded session, to be rewritten with other frames."""

    def __init__(self, name):
        self.path = SESSIONS / name
        lines = (self.path / "session.index").read_bytes().splitlines()
        self.lines = [line[:-9] for line in lines]
        self.pair = next(line for line in self.lines if line.startswith(b"pair"))
        self.names = [word.split(b"=")[1].decode() for word in self.pair.split()
                      if b"_frame=" in word]
        self.images = [cv2.imread(str(self.path / f"frame-{name}.pnm"), cv2.IMREAD_UNCHANGED)
                       for name in self.names]

    def write(self, target, images):
        target.mkdir()
        for file in self.path.glob("calibration-*"):
            shutil.copy(file, target)
        pair = self.pair
        for side, name, image in zip(("left", "right"), self.names, images):
            data = (f"P5\n{image.shape[1]} {image.shape[0]}\n{WHITE}\n".encode()
                    + numpy.ascontiguousarray(image).astype(">u2").tobytes())
            crc = f"{zlib.crc32(data):08x}"
            (target / f"frame-{crc}.pnm").write_bytes(data)
            pair = pair.replace(f"{side}_frame={name}".encode(), f"{side}_frame={crc}".encode())
        text = b""
        for line in self.lines:
            text += (pair if line == self.pair else line) + b" "
            text += b"%08x\n" % zlib.crc32(text[:-1])
        (target / "session.index").write_bytes(text)
        return target


class Pictures(pairs.Fixture):
    def measured(self, *arguments):
        """The messages about the surface, and the result if there is one."""
        shutil.rmtree(self.out, ignore_errors=True)
        done = pairs.run("reconstruct", *arguments, "--out", self.out)
        path = self.out / "result.json"
        result = json.loads(path.read_text()) if path.exists() else None
        self.assertEqual(done.returncode, 0 if result else 4, done.stderr)
        output_text = [line for line in done.stderr.splitlines()
                if "could be measured" in line or "no surface" in line]
        return " ".join(output_text), result

    def named(self, words, *arguments):
        output_text, _ = self.measured(*arguments)
        for word in words:
            self.assertIn(word, output_text)
        return output_text

    def recorded(self, left, right, name="changed"):
        target = self.directory / name
        shutil.rmtree(target, ignore_errors=True)
        return self.session.write(target, (left, right))

    def test_recorded_scenes(self):
        """No false alarm on good pictures; each cause is named once it exists."""
        for name in ("cylinder_1x", "mug_3x", "chessboard_1x"):
            output_text, result = self.measured(SESSIONS / name)
            self.assertEqual(output_text, "", name)
            for side in ("left", "right"):
                figures = result["pictures"][side]
                self.assertGreater(figures["brightness_percent"], 10)
                self.assertEqual(figures["saturated_percent"], 0)
                self.assertGreater(figures["sharpness_percent"], 60)
        random = numpy.random.default_rng(pairs.SEED)
        self.session = Session("cylinder_1x")
        left, right = self.session.images
        self.assertEqual(self.measured(self.recorded(left, right))[0], "")
        for words, first, second in (
                (("both", "too dark"), exposed(left, 0.03, random), exposed(right, 0.03, random)),
                (("the right image is too dark",), left, exposed(right, 0.02, random)),
                (("both", "too bright"), exposed(left, 14, random), exposed(right, 14, random)),
                (("the left image is too bright",), exposed(left, 10, random), right),
                (("both", "blurred"), exposed(blurred(left, 10), 1, random),
                 exposed(blurred(right, 10), 1, random)),
                (("the right image is blurred",), left, exposed(blurred(right, 5), 1, random)),
                (("the left image is blurred",), exposed(blurred(left, 5), 1, random), right)):
            with self.subTest(words):
                self.named(words, self.recorded(first, second))
        # Half a turn, by whole cells of the mosaic.
        turned = right.reshape(200, 2, 336, 2)[::-1, :, ::-1, :].reshape(right.shape)
        self.named(("upside down", "rotated"), self.recorded(left, turned))
        # A camera that looks two thirds of the picture to the side, at another scene.
        other = Session("mug_3x").images[1][:400]
        aside = numpy.hstack([right[:, 400:], other[:, :400]])
        self.named(("the views overlap by only 4", "aim both cameras"), self.recorded(left, aside))
        self.named(("differ too much", "aimed at the same"), self.recorded(left, other))

    def test_plain_images(self):
        """The same for image files, with the figures in result.json."""
        output_text, result = self.measured(self.left_path, self.right_path, *pairs.RECTIFIED)
        self.assertEqual(output_text, "")
        self.assertAlmostEqual(result["pictures"]["left"]["brightness_percent"],
                               100 * self.left.mean() / 255, delta=0.5)
        random = numpy.random.default_rng(pairs.SEED)
        # Of 2 % of the light, six grey levels, four fifths of the surface are found.
        dark = self.save("dark.png", cv2.add((self.right * 0.01).astype(numpy.uint8),
                                             random.integers(0, 3, self.right.shape, numpy.uint8)))
        self.named(("the right image is too dark",), self.left_path, dark, *pairs.RECTIFIED)
        soft = self.save("soft.png", cv2.GaussianBlur(self.right, (0, 0), 4))
        output_text = self.named(("the right image is blurred",), self.left_path, soft, *pairs.RECTIFIED)
        self.assertNotIn("calibration", output_text)
        flipped = self.save("flipped.png", self.right[::-1])
        self.named(("flipped",), self.left_path, flipped, *pairs.RECTIFIED)
        mirrored = [self.save(f"{side}-mirrored.png", image[:, ::-1])
                    for side, image in (("left", self.left), ("right", self.right))]
        for pair in ((self.right_path, self.left_path), mirrored):
            self.named(("left and right are swapped", "mirrored"), *pair, *pairs.RECTIFIED)

    def test_same_picture(self):
        again = self.save("again.png", self.left)
        done = pairs.run("reconstruct", self.left_path, again, *pairs.RECTIFIED, "--out", self.out)
        self.assertEqual(done.returncode, 3, done.stderr)
        line, = done.stderr.splitlines()
        for word in ("left.png", "again.png", "the same image"):
            self.assertIn(word, line)
        self.assertFalse(self.out.exists())
        black = self.save("black.png", numpy.zeros_like(self.left))
        self.named(("both", "too dark"), black, black, *pairs.RECTIFIED)


if __name__ == "__main__":
    unittest.main()
