# SPDX-License-Identifier: Apache-2.0
"""`vergence.batch`: all pairs of sessions, here and on a cluster of two workers of which one is killed."""
import os
import signal
import unittest

import cv2
import numpy

import package
from pairs import BASELINE_MM, FOCAL_PX, Fixture
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
        return {path.relative_to(out): path.read_bytes() for path in sorted(out.rglob("disparity.pfm"))}

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
        with self.assertRaises(self.vergence.ArgumentError):
            self.vergence.batch(self.directory, self.out)

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
        self.assertEqual(killed, processes[:1])
        self.assertEqual([row.error for row in rows], [None] * (PAIRS + 1))
        self.assertEqual(self.content(self.out), self.content(expected))


if __name__ == "__main__":
    unittest.main()
