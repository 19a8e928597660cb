# SPDX-License-Identifier: Apache-2.0
"""Pictures one after the other for a program that shows them live, from webcams of a fake kernel."""
import base64
import json
import unittest

import numpy

from fake_devices import DeviceTest, show, texture
from daemon_process import framed
from waiting import wait_until


class Streaming(DeviceTest):
    def setUp(self):
        super().setUp()
        self.serve(self.cameras(), "profile=two-cameras")
        self.asked("bringup")

    def picture(self, answer, data):
        self.assertTrue(answer["ok"], answer)
        result = answer["result"]
        self.assertEqual(result["calibration_bytes"], 0)
        shape = result["height"], result["width"], result["channels"]
        return numpy.frombuffer(data, numpy.uint8).reshape(shape).astype(int)

    def streamed(self, client, *words):
        answer = client.ask_json(" ".join(("stream", *words)), "json,binary")
        return self.picture(answer, client.take(answer["result"]["bytes"]))

    def shows(self, picture, seeds, tolerance):
        """Whether the picture is of the textures of these seeds; webcams send half the colours."""
        expected = numpy.hstack([texture(seed) for seed in seeds]).astype(int)
        return numpy.median(numpy.abs(picture - expected)) <= tolerance

    def test_pictures_are_what_the_cameras_see_now(self):
        self.assertTrue(self.shows(self.streamed(self.first), (0, 1), 2))
        show(self.pictures[0], texture(7))
        # A frame that was under way shows the picture before.
        wait_until(lambda: self.shows(self.streamed(self.first), (7, 1), 2), "the old picture")
        grey = self.streamed(self.first, "side=160", "colour=no")
        self.assertEqual(grey.shape, (120, 320, 1))
        expected = texture(1) @ numpy.array((77, 150, 29)) / 256
        means = expected.reshape(120, 4, 160, 4).mean(axis=(1, 3))
        self.assertLess(numpy.median(numpy.abs(grey[:, 160:, 0] - means)), 3)

    def test_a_line_that_damages_bytes_gets_text(self):
        self.first.send(framed("stream side=160 colour=no"))
        answer = json.loads(self.first.line())
        data = base64.b64decode(answer["result"]["data"], validate=True)
        self.assertEqual(len(data), answer["result"]["bytes"])
        self.assertEqual(self.picture(answer, data).shape, (120, 320, 1))
        self.first.send(framed("stream"))
        answer = json.loads(self.first.line())
        self.assertEqual(answer["error"], "RANGE")
        self.assertIn("side=160 colour=no", answer["message"])

    def test_a_client_that_reads_slowly_gets_each_picture_whole_and_stops_no_other(self):
        slow, gone = self.client(), self.client()
        slow.send("@json,binary stream\n" * 3)
        gone.send("@json,binary stream\n" * 3)
        for _ in range(3):
            self.assertTrue(self.shows(self.streamed(self.first), (0, 1), 2))
        gone.socket.close()
        self.asked("status")
        for _ in range(3):
            answer = json.loads(slow.line())
            picture = self.picture(answer, slow.take(answer["result"]["bytes"]))
            self.assertTrue(self.shows(picture, (0, 1), 2))
        self.assertEqual(slow.left, b"")

    def test_a_client_that_knows_nothing_of_bytes_gets_none(self):
        for command in ("stream", "watch 0.1 stream"):
            answer = self.first.ask_json(command)
            self.assertEqual(answer["error"], "UNSUPPORTED", answer)
        self.asked("status")

    def test_a_recording_goes_first(self):
        self.asked("record start scene")
        self.asked("bringup")
        answer = self.first.ask_json("stream", "json,binary")
        self.assertEqual(answer["error"], "BUSY")
        self.asked("record stop")
        self.asked("bringup")
        self.assertTrue(self.shows(self.streamed(self.first), (0, 1), 2))


if __name__ == "__main__":
    unittest.main()
