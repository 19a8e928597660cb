# SPDX-License-Identifier: Apache-2.0
"""Recordings by independent writers: MCAP and bags with messages of ROS 1 and ROS 2."""
import unittest

import cv2
import numpy

from foreign_readers import recording_readers
from pairs import BASELINE_MM, FOCAL_PX, HEIGHT, WIDTH, Fixture, run

SECOND_NS = 10**9
DATE_NS = 1795305600 * SECOND_NS  # that of recorded.Session


def frames_of(session):
    """The images of each pair, by its index."""
    pairs = []
    for line in (session / "session.index").read_text().splitlines():
        words = dict(word.split("=", 1) for word in line.split()[1:] if "=" in word)
        if line.startswith("pair "):
            pairs.append([cv2.imread(str(session / f"frame-{words[f'{side}_frame']}.pnm"),
                                     cv2.IMREAD_UNCHANGED) for side in ("left", "right")])
    return pairs


class Imports(Fixture):
    def take(self, *arguments):
        done = run("import", *arguments, "--out", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        return frames_of(self.out)

    def refused(self, words, *arguments, code=3):
        self.assert_refused(run("import", *arguments, "--out", self.out), code, *words)


class Recordings(Imports):
    @classmethod
    def setUpClass(cls):
        try:
            cls.rosbags, cls.mcap = recording_readers()
        except RuntimeError as error:
            raise unittest.SkipTest(f"no rosbags and mcap of PyPI: {str(error).splitlines()[0]}")
        store, stores = cls.rosbags.typesys.get_typestore, cls.rosbags.typesys.Stores
        cls.stores = {1: store(stores.ROS1_NOETIC), 2: store(stores.ROS2_HUMBLE)}

    def setUp(self):
        super().setUp()
        self.file = self.directory / "out.mcap"
        self.bag = self.directory / "drive.bag"

    def messages_of(self, images, ros, info=True, encoding=None, right_shift_ns=0, begin_ns=DATE_NS,
                    topics=("/left/image_raw", "/right/image_raw")):
        """Topic, type, bytes and time of each message. Images are BGR, grey or a mosaic."""
        types, name = self.stores[ros].types, "sensor_msgs/msg/"
        pack = self.stores[ros].serialize_ros1 if ros == 1 else self.stores[ros].serialize_cdr
        time, region = types["builtin_interfaces/msg/Time"], types[name + "RegionOfInterest"]
        for number, pair in enumerate(images):
            for side, (topic, image) in enumerate(zip(topics, pair)):
                at_ns = begin_ns + number * SECOND_NS // 10 + side * right_shift_ns
                head = types["std_msgs/msg/Header"](
                    *[number] * (ros == 1), time(at_ns // SECOND_NS, at_ns % SECOND_NS), "camera")
                height, width = image.shape[:2]
                messages = []
                if info:
                    K = numpy.array([FOCAL_PX, 0, (WIDTH - 1) / 2, 0, FOCAL_PX, (HEIGHT - 1) / 2,
                                     0, 0, 1])
                    P = numpy.insert(K, [3, 6, 9], 0.0)
                    P[3] = -FOCAL_PX * BASELINE_MM / 1000 * side
                    messages.append((topic.rsplit("/", 1)[0] + "/camera_info", name + "CameraInfo",
                                     (head, height, width, "plumb_bob", numpy.zeros(5), K,
                                      numpy.eye(3).ravel(), P, 0, 0, region(0, 0, 0, 0, False))))
                if encoding in ("png", "jpeg"):
                    data = cv2.imencode("." + encoding, image)[1].ravel()
                    messages.append((topic + "/compressed", name + "CompressedImage",
                                     (head, encoding, data)))
                else:
                    kind = encoding or ("mono16" if image.dtype.itemsize == 2 else
                                        "bgr8" if image.ndim == 3 else "mono8")
                    data = image[:, :, ::-1].copy() if kind == "rgb8" else image
                    messages.append((topic, name + "Image",
                                     (head, height, width, kind, 0, data.strides[0],
                                      data.ravel().view(numpy.uint8))))
                for topic, kind, values in messages:
                    yield topic, kind, bytes(pack(types[kind](*values), kind)), at_ns

    def write_mcap(self, images, ros=2, compression=None, crcs=True, **options):
        """By the package mcap; of ROS 1 as "mcap convert" does it."""
        none, encoding, schema = self.mcap.writer.CompressionType.NONE, "cdr", "ros2msg"
        if ros == 1:
            encoding, schema = "ros1", "ros1msg"
        with open(self.file, "wb") as stream:
            writer = self.mcap.writer.Writer(stream, compression=compression or none,
                                             enable_crcs=crcs)
            writer.start(profile=f"ros{ros}", library="test")
            channels = {}
            for topic, name, data, at_ns in self.messages_of(images, ros, **options):
                if topic not in channels:
                    text, _ = self.stores[ros].generate_msgdef(name, ros_version=ros)
                    written = name.replace("/msg", "") if ros == 1 else name
                    channels[topic] = writer.register_channel(
                        topic, encoding, writer.register_schema(written, schema, text.encode()))
                writer.add_message(channels[topic], at_ns, data, at_ns)
            writer.finish()

    def write_bag(self, images, compression=None, chunk_bytes=200000, path=None, **options):
        """A bag of ROS 1 by the package rosbags: several chunks."""
        path = path or self.bag
        path.unlink(missing_ok=True)
        writer = self.rosbags.rosbag1.Writer(path)
        writer.chunk_threshold = chunk_bytes
        if compression:
            writer.set_compression(writer.CompressionFormat[compression.upper()])
        with writer:
            self.put(writer, self.stores[1], self.messages_of(images, 1, **options))

    def write_sqlite(self, images, path):
        """A directory as "ros2 bag record" made it before it wrote MCAP."""
        with self.rosbags.rosbag2.Writer(path, version=9) as writer:
            self.put(writer, self.stores[2], self.messages_of(images, 2))

    def put(self, writer, store, messages):
        connections = {}
        for topic, name, data, at_ns in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=store)
            writer.write(connections[topic], at_ns, data)
