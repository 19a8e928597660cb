# SPDX-License-Identifier: Apache-2.0
"""Sessions as MCAP files that independent readers take; data sets, side-by-side images and videos as
sessions."""
import json
import shutil
import unittest

import cv2
import numpy

from pairs import BASELINE_MM, FOCAL_PX, HEIGHT, VERGENCE, WIDTH, grey, make_pair, run
from recorded import Session
from recordings import DATE_NS, SECOND_NS, Imports, Recordings

AXES = ("4805,6736:8,8640:8,1600:8", "4795,6736:8,8640:8,1600:8")
INSTRUMENT = ("left_camera=A1 right_camera=B2 left_servo=4800,9600 right_servo=4800,9600 "
              "pan_repeatability_urad=100 lens_repeatability_counts=1 lens_zoom_ppm=100")


def rotation(quaternion):
    w, v = quaternion.w, numpy.array([quaternion.x, quaternion.y, quaternion.z])
    cross = numpy.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return numpy.eye(3) + 2 * w * cross + 2 * cross @ cross


class Export(Recordings):
    def make_session(self, pairs=3, colour=False, calibrated=True):
        session, made = Session(self.directory / "views", instrument=INSTRUMENT), []
        if calibrated:
            session.calibration(self.calibration_text().read_bytes())
        for number in range(pairs):
            images = make_pair(seed=number)[:2]
            images = images if colour else [grey(image) for image in images]
            session.pair(*[image[:, :, ::-1] if colour else image for image in images], axes=AXES)
            made.append(images)
        session.end()
        return session.path, made

    def export(self, session, *options):
        done = run("export", session, "--mcap", self.file, *options)
        self.assertEqual((done.returncode, done.stdout), (0, f"written: {self.file}\n"), done.stderr)

    def messages(self):
        """Messages by topic, with the time and type of each, as rosbags reads them; its types come
        from the definitions in the file."""
        found = {}
        with self.rosbags.highlevel.AnyReader([self.file]) as reader:
            for connection, time_ns, raw in reader.messages():
                found.setdefault(connection.topic, []).append(
                    (time_ns, connection.msgtype, reader.deserialize(raw, connection.msgtype)))
        return found

    def test_a_session_as_independent_readers_see_it(self):
        session, made = self.make_session()
        self.export(session)
        found = self.messages()
        self.assertEqual(sorted(found), ["/diagnostics", "/left/camera_info", "/left/image_raw",
                                         "/right/camera_info", "/right/image_raw", "/tf"])
        for side, name in enumerate(("left", "right")):
            self.assertEqual([at for at, _, _ in found[f"/{name}/image_raw"]],
                             [DATE_NS + number * SECOND_NS // 1000 for number in range(3)])
            for (at, kind, image), images in zip(found[f"/{name}/image_raw"], made):
                self.assertEqual((kind, image.encoding, image.header.stamp.sec),
                                 ("sensor_msgs/msg/Image", "mono8", DATE_NS // SECOND_NS))
                self.assertTrue(numpy.array_equal(image.data.reshape(HEIGHT, WIDTH), images[side]))
        right = found["/right/camera_info"][0][2]
        self.assertEqual((right.width, right.height, right.distortion_model),
                         (WIDTH, HEIGHT, "plumb_bob"))
        self.assertAlmostEqual(right.p[3], -FOCAL_PX * BASELINE_MM / 1000, places=6)
        poses = {}
        for _, _, message in found["/tf"]:
            for one in message.transforms:
                poses[one.header.frame_id, one.child_frame_id] = one.transform
        self.assertAlmostEqual(poses["left_camera", "right_camera"].translation.x,
                               BASELINE_MM / 1000)
        # The left servo is 5/9600 rad to the right of its middle.
        turned = rotation(poses["rig", "left_camera"].rotation) @ (0, 0, 1)
        self.assertAlmostEqual(turned[0], 5 / 9600, places=7)
        values = {status.name: {value.key: value.value for value in status.values}
                  for status in found["/diagnostics"][0][2].status}
        self.assertEqual((values["left zoom"]["position"], values["right focus"]["position"]),
                         ("421", "540"))
        # The checksums, and the index.
        with open(self.file, "rb") as stream:
            reader = self.mcap.reader.make_reader(stream, validate_crcs=True)
            self.assertEqual(reader.get_summary().statistics.chunk_count, 3)
            self.assertEqual(sum(1 for _ in reader.iter_messages(topics=["/tf"])), 6)

    def test_a_result(self):
        session, _ = self.make_session(pairs=2)
        done = run("reconstruct", session, "--pair", 2, "--near", 1000, "--far", 6000, "--out", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.export(session, "--result", self.out)
        found = self.messages()
        (at, _, disparity), = found["/disparity"]
        self.assertEqual(at, found["/left/image_raw"][1][0])
        height, width = disparity.image.height, disparity.image.width
        values = disparity.image.data.view(numpy.float32).reshape(height, width)
        measured = values >= disparity.min_disparity
        (_, _, points), = found["/points"]
        table = points.data.view(numpy.float32).reshape(-1, 5)
        depth = disparity.f * disparity.t / values[measured]
        self.assertAlmostEqual(numpy.median(depth), numpy.median(table[:, 2]), delta=0.05)
        self.assertEqual([field.name for field in points.fields], ["x", "y", "z", "rgb", "sigma"])
        self.assertEqual(points.width, json.loads((self.out / "result.json").read_text())
                         ["counts"]["vertices"])

    def test_a_round_trip(self):
        session, made = self.make_session(colour=True)
        for options, wanted in (([], made), (["--compressed", "--pair", 2], made[1:2])):
            self.export(session, *options)
            for images, before in zip(self.take(self.file), wanted, strict=True):
                self.assertTrue(numpy.array_equal(images, before))
            again = self.directory / "again"
            self.assertEqual(run("reconstruct", self.out, "--near", 1000, "--far", 6000,
                                 "--out", again).returncode, 0)
            shutil.rmtree(again)
            shutil.rmtree(self.out)

    def test_sensors_of_ten_bits(self):
        session = Session(self.directory / "raw")
        session.calibration(self.calibration_text().read_bytes())
        random = numpy.random.default_rng(1)
        images = [random.integers(0, 1024, (HEIGHT, WIDTH), numpy.uint16) for _ in range(2)]
        session.pair(*images, layout="grbg")
        session.end()
        self.export(session.path)
        (_, _, image), = self.messages()["/left/image_raw"]
        self.assertEqual(image.encoding, "bayer_grbg16")
        self.assertTrue(numpy.array_equal(image.data.view(numpy.uint16), images[0].ravel() << 6))
        taken, = self.take(self.file)
        self.assertTrue(numpy.array_equal(taken[1], images[1]))
        self.assertIn("left_bits=10 left_layout=grbg", (self.out / "session.index").read_text())


class Folders(Imports):
    """Without any package of others."""

    def test_data_sets(self):
        pairs = [[grey(image) for image in make_pair(seed=number)[:2]] for number in range(3)]
        matrix = f"K_0X: {FOCAL_PX} 0 119.5 0 {FOCAL_PX} 79.5 0 0 1\n"
        projection = f"{FOCAL_PX} 0 119.5 TX 0 {FOCAL_PX} 79.5 0 0 0 1 0\n"
        kitti = "".join(
            f"P_rect_0{camera}: " + projection.replace("TX", str(shift)) +
            f"S_rect_0{camera}: {WIDTH} {HEIGHT}\nS_0{camera}: {WIDTH} {HEIGHT}\n" +
            matrix.replace("X", str(camera)) for camera, shift in ((2, 0), (3, -50)))
        odometry = "".join(f"P{camera}: " + projection.replace("TX", str(shift))
                           for camera, shift in ((0, 0), (1, -50)))
        euroc = ("sensor_type: camera\ncamera_model: pinhole\nrate_hz: 20\nresolution: [240, 160]\n"
                 f"intrinsics: [{FOCAL_PX}, {FOCAL_PX}, 119.5, 79.5]\n"
                 "distortion_model: none\nT_BS:\n  rows: 4\n  cols: 4\n"
                 "  data: [1, 0, 0, TX, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n")
        forms = {
            "euroc": (("mav0/cam0/data", "mav0/cam1/data"), "14036365797632{:05d}.png",
                      {"mav0/cam0/sensor.yaml": euroc.replace("TX", "0"),
                       "mav0/cam1/sensor.yaml": euroc.replace("TX", "0.1")}, []),
            "kitti": (("image_02/data", "image_03/data"), "{:010d}.png",
                      {"calib_cam_to_cam.txt": kitti,
                       "image_02/timestamps.txt": "2011-09-26 13:02:25.594360375\n" * 3}, []),
            "odometry": (("image_0", "image_1"), "{:06d}.png", {"calib.txt": odometry}, []),
            "tum": (("left", "right"), "1311868164.{:06d}.png", {},
                    ["--calibration", self.calibration_text()]),
        }
        for name, (folders, pattern, texts, options) in forms.items():
            with self.subTest(name):
                root = self.directory / name
                for side, folder in enumerate(folders):
                    (root / folder).mkdir(parents=True)
                    for number, pair in enumerate(pairs):
                        # Times in the right folder differ a little.
                        stem = pattern.format(1000 * number + (side if name == "tum" else 0))
                        cv2.imwrite(str(root / folder / stem), pair[side])
                for path, text in texts.items():
                    (root / path).write_text(text)
                taken = self.take(root, *options)
                self.assertEqual(len(taken), 3)
                self.assertTrue(numpy.array_equal(taken[2][1], pairs[2][1]))
                explained = run("info", self.out)
                self.assertEqual(explained.returncode, 0, explained.stderr)
                result = self.directory / "result"
                done = run("reconstruct", self.out, "--near", 1000, "--far", 6000, "--out", result)
                self.assertEqual(done.returncode, 0, done.stderr)
                shutil.rmtree(result)
                shutil.rmtree(self.out)
                if texts:
                    for path in texts:
                        (root / path).unlink()
                    self.refused(["no calibration: it has no"], root)

    def test_side_by_side(self):
        rig = ["--calibration", self.calibration_text()]
        both = numpy.hstack([self.left, self.right])
        path = self.save("both.png", both)
        taken = self.take(path, "--side-by-side", *rig)
        self.assertTrue(numpy.array_equal(taken[0][0], self.left))
        self.assertTrue(numpy.array_equal(taken[0][1], self.right))
        shutil.rmtree(self.out)
        self.refused(["no two halves"], self.save("odd.png", both[:, :-1]), "--side-by-side", *rig)

    def test_a_video(self):
        if shutil.which("ffmpeg") is None:
            self.skipTest("no ffmpeg")
        rig = ["--calibration", self.calibration_text()]
        both = numpy.hstack([self.left, self.right])
        path = self.directory / "video.avi"
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 25, both.shape[1::-1])
        for _ in range(5):
            writer.write(both)
        writer.release()
        taken = self.take(path, "--side-by-side", *rig, "--every", 2)
        self.assertEqual(len(taken), 3)
        self.assertLess(numpy.abs(taken[2][1].astype(int) - self.right).mean(), 12)
        index = (self.out / "session.index").read_text()
        self.assertIn("left_begin_us=80000 ", index)
        shutil.rmtree(self.out)
        broken = self.directory / "broken.avi"
        broken.write_bytes(path.read_bytes()[:100])
        self.refused(["ffmpeg cannot decode"], broken, "--side-by-side", *rig)
        done = run("import", path, "--side-by-side", *rig, "--out", self.out, env={"PATH": "/nowhere"})
        self.assert_refused(done, 3, "apt install ffmpeg")

    def test_sessions_of_a_newer_version(self):
        session = Session(self.directory / "newer")
        session.index = b""
        session.line("begin version=99 build=test profile=two-cameras date=2026-11-22T00:00:00Z")
        file = self.directory / "out.mcap"
        done = run("export", session.path, "--mcap", file)
        self.assert_refused(done, 3, "version")
        self.assertFalse(file.exists())

    def test_a_full_disk_leaves_nothing(self):
        path = self.save("both.png", numpy.hstack([self.left, self.right]))
        session = Session(self.directory / "views")
        session.pair(self.left, self.right)
        session.end()
        file = self.directory / "out.mcap"
        rig = ["--calibration", self.calibration_text()]
        for words in (["import", path, "--side-by-side", *rig, "--out", self.out],
                      ["export", session.path, *rig, "--mcap", file]):
            done = run("-c", 'ulimit -f 50; exec "$@"', "bash", VERGENCE, *words, program="bash")
            self.assert_refused(done, 1)
            self.assertFalse(file.exists())


if __name__ == "__main__":
    unittest.main()
