# SPDX-License-Identifier: Apache-2.0
"""`vergence.batch`: all pairs of sessions, here and on a cluster of two workers of which one is killed."""
import os
import shutil
import signal
import unittest

import cv2
import numpy

import package
from pairs import BASELINE_MM, FOCAL_PX, Fixture, run
from recorded import Session

OPTIONS = {"rectified": True, "focal_px": FOCAL_PX, "baseline_mm": BASELINE_MM, "disparity": (0, 48)}
FILES = ["disparity.pfm", "result.json"]
PAIRS = 12


class Batch(Fixture):
    @classmethod
    def setUpClass(cls):
        cls.vergence = package.load()

    def setUp(self):
        super().setUp()
        self.sessions = self.directory / "sessions"
        self.sessions.mkdir()
        rgb = [cv2.cvtColor(image, cv2.COLOR_BGR2RGB) for image in (self.left, self.right)]
        for name, pairs in (("long", PAIRS), ("short", 1)):
            session = Session(self.sessions / name)
            for number in range(pairs):
                session.pair(*[numpy.roll(image, number, axis=0) for image in rgb])
            session.end()

    def content(self, out):
        # A worker that is killed while it writes leaves a hidden folder.
        return {path.relative_to(out): path.read_bytes() for path in sorted(out.rglob("disparity.pfm"))
                if ".vergence-" not in str(path.relative_to(out))}

    def test_rows_and_files_here(self):
        frame = next((self.sessions / "short").glob("frame-*"))
        frame.write_bytes(frame.read_bytes()[:-1])
        seen = []
        rows = self.vergence.batch(self.sessions, self.out, files=FILES, progress=seen.append, **OPTIONS)
        self.assertEqual(seen, rows)
        self.assertEqual([row.pair for row in rows], [*range(1, PAIRS + 1), 1])
        self.assertIn(frame.name, rows[-1].error)
        self.assertEqual(len(self.content(self.out)), PAIRS)
        self.assertAlmostEqual(rows[0].depth_mm, FOCAL_PX * BASELINE_MM / 12, delta=20)
        self.assertIn(" points ", str(rows[0]))

    def stamps(self):
        return {path: path.stat().st_mtime_ns for path in self.out.rglob("disparity.pfm")}

    def test_an_interrupted_batch_continues_as_the_command_does(self):
        def stop_after_two(row):
            if row.pair == 2:
                raise KeyboardInterrupt
        with self.assertRaises(KeyboardInterrupt):
            self.vergence.batch(self.sessions / "long", self.out, files=FILES, progress=stop_after_two, **OPTIONS)
        before = self.stamps()
        self.assertEqual(len(before), 2)
        rows = self.vergence.batch(self.sessions / "long", self.out, files=FILES, **OPTIONS)
        self.assertEqual([row.kept for row in rows], [row.pair <= 2 for row in rows])
        self.assertEqual([row.result for row in rows], [str(self.out / f"{row.pair:04}") for row in rows])
        self.assertEqual({path: time for path, time in self.stamps().items() if path in before}, before)
        done = run("reconstruct", self.sessions / "long", "--all", "--rectified", "--focal", FOCAL_PX, "--baseline",
                   BASELINE_MM, "--disparity", "0:48", "--files", ",".join(FILES), "--out", self.out)
        self.assertIn(f"0 measured in 0.0 s, {PAIRS} kept", done.stdout, done.stderr)
        rows = self.vergence.batch(self.sessions / "long", self.out, files=FILES, speckle_px=20, **OPTIONS)
        self.assertFalse(any(row.kept for row in rows))

    def test_a_session_that_cannot_be_read_is_a_row(self):
        session = Session(self.sessions / "newer")
        session.index = b""
        session.line("begin version=99 build=test profile=two-cameras date=2026-11-22T00:00:00Z")
        shutil.rmtree(self.sessions / "long")
        rows = self.vergence.batch(self.sessions, self.out, files=FILES, **OPTIONS)
        self.assertEqual([row.pair for row in rows], [0, 1])
        self.assertIn("newer: a session of version 99", rows[0].error)
        self.assertIsNone(rows[1].error)

    def test_a_loaded_calibration_is_one_of_its_file(self):
        options = {"near_mm": 700, "far_mm": 3000, "files": FILES}
        calibration, short = self.calibration_text(), self.sessions / "short"
        rig = self.vergence.load_calibration(calibration)
        expected = self.directory / "expected"
        self.assertIsNone(self.vergence.batch(short, expected, calibration, **options)[0].error)
        self.assertIsNone(self.vergence.batch(short, self.out, rig, **options)[0].error)
        self.assertEqual(self.content(self.out), self.content(expected))
        self.assertTrue(self.vergence.batch(short, self.out, rig, **options)[0].kept)

    def test_wrong_arguments_are_found_before_the_work(self):
        for arguments, words in (({"progress": 5}, "progress is 5"), ({"pair": 2}, "cannot be combined"),
                                 ({"pair": object()}, "pair"), ({"near_mm": "x"}, "near"), ({"files": "x"}, "x"),
                                 ({"scheduler": 5}, "scheduler is 5"), ({"calibration": 5}, "calibration is 5"),
                                 ({"out": None}, "out is None"), ({"paths": 5}, "paths is 5"), ({"paths": []}, "no"),
                                 ({"paths": self.directory}, "neither a session nor"),
                                 ({"disparity": (0, 0)}, "disparity")):
            with self.subTest(arguments), self.assertRaisesRegex(self.vergence.ArgumentError, words):
                self.vergence.batch(**{"paths": self.sessions, "out": self.out, **OPTIONS, **arguments})
        with self.assertRaisesRegex(TypeError, "batch.. got an unexpected keyword argument 'nea_mm'"):
            self.vergence.batch(self.sessions, self.out, nea_mm=5)
        with self.assertRaisesRegex(self.vergence.ArgumentError, "progress is 5"):
            self.vergence.reconstruct(self.left, self.right, progress=5, **OPTIONS)
        self.assertFalse(self.out.exists())

    def test_a_scheduler_that_is_not_there_is_reported_at_once(self):
        try:
            import distributed  # noqa: F401
        except ImportError:
            self.skipTest("requires python3-distributed (tools/install_packages test)")
        for address in ("tcp://127.0.0.1:1", "nowhere"):
            with self.assertRaisesRegex(self.vergence.Error, f"{address}: no scheduler answers"):
                self.vergence.batch(self.sessions, self.out, scheduler=address, **OPTIONS)
        self.assertFalse(self.out.exists())

    def test_a_lost_worker_s_tasks_are_done_again(self):
        try:
            from distributed import Client, LocalCluster
        except ImportError:
            self.skipTest("requires python3-distributed (tools/install_packages test)")
        os.environ["PYTHONPATH"] = os.pathsep.join([str(package.build()), os.environ.get("PYTHONPATH", "")])
        expected = self.directory / "expected"
        self.vergence.batch(self.sessions, expected, files=FILES, **OPTIONS)
        killed = []
        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None,
                          local_directory=str(self.directory / "dask")) as cluster:
            with Client(cluster, set_as_default=False) as client:
                processes = list(client.run(os.getpid).values())

            def kill_one(_):
                if not killed:
                    killed.append(processes[0])
                    os.kill(processes[0], signal.SIGKILL)
            rows = self.vergence.batch(self.sessions, self.out, scheduler=cluster.scheduler_address, files=FILES,
                                       progress=kill_one, **OPTIONS)
            fetched = self.directory / "fetched"
            sent = self.vergence.batch(self.sessions, fetched, scheduler=cluster.scheduler_address, files=FILES,
                                       shared_paths=False, **OPTIONS)
        self.assertEqual(killed, processes[:1])
        for given, out in ((rows, self.out), (sent, fetched)):
            self.assertEqual([row.error for row in given], [None] * (PAIRS + 1))
            self.assertEqual(self.content(out), self.content(expected))
        kept = self.vergence.batch(self.sessions, fetched, files=FILES, **OPTIONS)
        self.assertTrue(all(row.kept for row in kept))


if __name__ == "__main__":
    unittest.main()
