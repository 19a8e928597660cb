# SPDX-License-Identifier: Apache-2.0
"""Recordings survive a killed daemon, a full disk, a closed client and the end of the service. What
was reported as recorded can be replayed."""
import os
import random
import resource
import shutil
import subprocess
import time
import unittest

from daemon_process import TIMEOUT_S, VERGENCED, DaemonTest
from waiting import wait_until

LEAD = ("bringup", "window 64 48")


class Recording(DaemonTest):
    def setUp(self):
        self.first = self.client()
        seed = int(os.environ.get("VERGENCE_TEST_SEED", random.randrange(1 << 32)))
        print(f"VERGENCE_TEST_SEED={seed}")
        self.chance = random.Random(seed)

    def tearDown(self):
        super().tearDown()
        self.first.ask("record stop")  # the next test starts without a recording

    def begin(self, name):
        self.first.ask("wait 4")  # a lens left moving by a killed daemon comes to rest
        for command in (f"record start {name}", *LEAD, "capture"):
            self.assertEqual(self.first.ask(command)[-1], "OK", command)

    def kill(self):
        self.daemon.kill()
        self.daemon.wait(TIMEOUT_S)
        self.daemon.returncode = 0  # intended: not a crash for the clean-up

    def restart(self):
        """Starts another daemon on the same rig after one has ended."""
        if os.path.exists(self.path):
            os.remove(self.path)  # so that the new socket can be awaited
        type(self).start()
        self.first = self.client()

    def play(self, name, captures, more=()):
        """The daemon's answers to the recorded commands, from the recording alone."""
        script = "\n".join([*LEAD, *[f"capture {name}-{i}" for i in range(captures)], *more, ""])
        done = subprocess.run(
            [VERGENCED, f"backend=replay {os.path.join(self.files, name)}", "socket=none",
             f"files={self.files}", "store=none", "console=stdio", "confine=no"],
            input=script, text=True, capture_output=True, timeout=TIMEOUT_S, check=False)
        self.assertEqual(done.stdout.count("OK\n"), len(LEAD) + captures,
                         done.stdout + done.stderr)
        for i in range(captures):
            played = self.frames(f"{name}-{i}")
            self.assertEqual(len(played), 2)
            self.assertLessEqual(played, self.frames(name))
        return done.stdout

    def frames(self, session):
        """The files of its frames, whose names are the CRC of their contents."""
        folder = os.path.join(self.files, session)
        return {name for name in os.listdir(folder) if name.startswith("frame-")}

    def index(self, name):
        with open(os.path.join(self.files, name, "session.index"), encoding="utf-8") as file:
            return file.read()

    def test_registers_stand_beside_each_pair(self):
        """In the index before the pair: registers of the bridge and of both sensors."""
        self.first.ask("wait 4")  # as in begin()
        for command in (*LEAD, "pan 2", "exposure 3000 side=left", "gain 2.5 side=right",
                        "capture regs"):
            self.assertEqual(self.first.ask(command)[-1], "OK", command)
        lines = self.index("regs").splitlines()
        kinds = [line.split()[0] for line in lines]
        self.assertLess(kinds.index("registers"), kinds.index("pair"))
        self.assertNotIn("registers", kinds[kinds.index("pair"):])
        found = {}
        for line in lines:
            if line.startswith("registers "):
                event = dict(word.split("=", 1) for word in line.split()[1:-1])
                first = int(event["first"], 16)
                for at, value in enumerate(event["values"].split(",")):
                    found[event["part"].replace("%20", " "), first + at] = int(value, 16)
        pair = dict(word.split("=", 1) for word in lines[kinds.index("pair")].split()[1:-1])
        self.assertEqual(found["FPGA bridge", 0x00], 0x5B1D)
        for side, part, servo in (("left", "left sensor", 0x11), ("right", "right sensor", 0x19)):
            self.assertEqual(found["FPGA bridge", servo], int(pair[f"{side}_after"].split(",")[0]))
            reported = self.first.ask_json(f"registers {side}")["result"]
            self.assertEqual(len(reported), 23)
            own = [value for (of, _), value in sorted(found.items()) if of == part]
            self.assertEqual(own, [int(value, 16) for value in reported.values()])
        self.assertNotEqual(found["left sensor", 0x09], found["right sensor", 0x09])
        self.assertNotEqual(found["left sensor", 0x2B], found["right sensor", 0x2B])
        # All named registers of the bridge; counters have advanced since.
        reported = self.first.ask_json("registers bridge")["result"]
        self.assertEqual(len(reported), len([of for of, _ in found if of == "FPGA bridge"]))

    def test_a_directory_of_files_that_is_taken_away(self):
        """It is reported, also in the log, until the daemon is restarted."""
        for command in LEAD:
            self.assertEqual(self.first.ask(command)[-1], "OK", command)
        shutil.rmtree(self.files)
        os.mkdir(self.files)
        for command in ("capture z", "record start z", "files", "bugreport",
                        "reconstruct z"):
            answer = self.first.ask(command)[-1]
            self.assertTrue(answer.startswith("ERR DEVICE ") and self.files in answer,
                            (command, answer))
        self.assertIn("error: capture z: ERR DEVICE ", "\n".join(self.first.ask("log")))
        self.assertEqual(os.listdir(self.files), [])
        self.end(self.daemon)
        self.restart()
        for command in (*LEAD, "capture z"):
            self.assertEqual(self.first.ask(command)[-1], "OK", command)

    def test_killed_at_any_moment(self):
        for round_ in range(2):
            name = f"killed{round_}"
            self.begin(name)
            self.first.send("capture\nzoom 500\ncapture\n")
            time.sleep(self.chance.uniform(0, 0.5))
            self.kill()
            self.restart()
            self.assertNotIn("\nend ", self.index(name))
            pairs = self.index(name).count("\npair ")
            self.assertGreaterEqual(pairs, 1)
            self.play(name, 1)

    def test_a_full_disk_keeps_the_earlier_pairs(self):
        self.begin("full")
        log = os.path.join(self.files, "full", "calls.log")
        unlimited = resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE,
                         (os.path.getsize(log) + 1000, unlimited[1]))
        answer = self.first.ask("capture")
        cut = "full/calls.log: cannot be written: File too large"
        self.assertEqual(len(answer), 1)
        self.assertTrue(answer[0].startswith(f"ERR FULL {cut}; the recording is cut off"), answer)
        self.assertEqual(self.first.ask("record"), ["recording: full", f"cut_off: {cut}", "OK"])
        self.assertIn(f"cut_off: {cut}", self.first.ask("status"))
        lines = "\n".join(self.first.ask("log 10"))
        self.assertEqual(lines.count(f"error: the recording is cut off: {cut}"), 1, lines)
        self.assertEqual(lines.count("error: capture: ERR FULL"), 1, lines)
        resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, unlimited)
        # Space is available again, but the missing data is not: the recording reports that until it
        # ends.
        self.assertEqual(self.first.ask("capture")[0][:8], "ERR FULL")
        self.assertRegex(self.first.ask("record stop")[-1], "^ERR FULL full/calls.log: .*File too "
                         "large; .*cut off")
        # It does not count as complete.
        self.assertNotIn("\nend ", self.index("full"))
        played = self.first.ask("replay full")
        self.assertEqual(played[-1], "OK")
        self.assertIn("cut_off: yes", played)
        self.assertEqual(self.first.ask("record"), ["recording: nothing", "OK"])
        self.play("full", 1)
        self.begin("after")
        self.assertEqual(self.first.ask("record stop")[-1], "OK")
        self.play("after", 1)

    def test_a_full_disk_leaves_no_session_without_a_pair(self):
        for command in (*LEAD, "capture good"):
            self.assertEqual(self.first.ask(command)[-1], "OK", command)
        unlimited = resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE)
        # There is space for the index but for no frame; then for no index line.
        for limit, command in ((4000, "capture bad"), (20, "capture bad"), (20, "record start bad")):
            resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, (limit, unlimited[1]))
            answer = self.first.ask(command)
            resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, unlimited)
            self.assertEqual(answer[-1][:8], "ERR FULL", (limit, command))
            self.assertFalse(os.path.exists(os.path.join(self.files, "bad")), (limit, command))
        # A folder with other things is not used.
        folder = os.path.join(self.files, "mine")
        os.mkdir(folder)
        with open(os.path.join(folder, "frame-list.txt"), "w", encoding="ascii") as file:
            file.write("notes")
        self.assertEqual(self.first.ask("capture mine")[-1][:12], "ERR ARGUMENT")
        self.assertEqual(os.listdir(folder), ["frame-list.txt"])

    def test_a_client_that_goes_takes_no_recording_with_it(self):
        self.begin("alone")
        gone = self.client()
        gone.send("capture\nzoom 700\n")
        time.sleep(self.chance.uniform(0, 0.3))
        gone.socket.close()
        self.assertEqual(self.first.ask("record")[0], "recording: alone")
        self.assertEqual(self.first.ask("record stop")[-1], "OK")
        self.assertIn("\nend ", self.index("alone"))
        self.play("alone", 1)

    def test_the_end_of_the_service_ends_the_recording_in_order(self):
        self.begin("ended")
        self.first.send("wait 1000\n")
        time.sleep(self.chance.uniform(0, 0.3))
        self.end(self.daemon)
        self.assertIn("\nend ", self.index("ended"))
        self.restart()
        self.play("ended", 1)


class RealTime(DaemonTest):
    """Only in real time the rig idles: its bridge's watchdog is fed between commands."""

    @classmethod
    def begin_rig(cls, *words):
        super().begin_rig("--wall", *words)

    def test_idling_is_replayed_where_it_was(self):
        client = self.client()
        self.assertEqual(client.ask("record start idle")[-1], "OK")

        answers = []  # of what is recorded; on a slow machine not all are OK

        def ask(command):
            answers.append(client.ask(command)[-1])

        def idled():
            status = client.ask_json("status")
            answers.append("OK" if status["ok"] else "ERR")
            if status["result"]["state"] != "ready":
                ask("bringup")  # a slow machine may miss the watchdog
            with open(os.path.join(self.files, "idle", "calls.log"), encoding="ascii") as file:
                return "\nidle\n" in file.read()

        wait_until(idled)
        ask("window 64 48")
        ask("capture")
        self.assertEqual(client.ask("record stop")[-1], "OK")
        self.assertEqual(client.ask("replay idle")[-1], "OK")
        # As a backend too: the rig idles where it did.
        with open(os.path.join(self.files, "idle", "session.index"), encoding="ascii") as file:
            commands = [line.split()[1][len("text="):].replace("%20", " ") for line in file
                        if line.startswith("command ")]
        done = subprocess.run(
            [VERGENCED, f"backend=replay {os.path.join(self.files, 'idle')}", "socket=none",
             f"files={self.files}", "store=none", "console=stdio", "confine=no"],
            input="".join(f"{line}\n" for line in commands), text=True, capture_output=True,
            timeout=TIMEOUT_S, check=False)
        self.assertEqual(len(answers), len(commands))
        self.assertEqual(done.stdout.count("OK\n"), answers.count("OK"), done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
