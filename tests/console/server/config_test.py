# SPDX-License-Identifier: Apache-2.0
"""Settings: what is wrong in a file is said with its line; the example in the tree has all keys."""
import os
import subprocess
import tempfile
import unittest

VERGENCED = os.environ["VERGENCED"]
EXAMPLE = os.path.join(os.environ["VERGENCE_SOURCE"], "daemon", "vergenced.conf")


def run(*words, **options):
    return subprocess.run([VERGENCED, *words], stderr=subprocess.PIPE, text=True, timeout=60,
                          env={**os.environ, "STATE_DIRECTORY": "x"},  # defaults of the system
                          **{"stdout": subprocess.PIPE, **options})


class Config(unittest.TestCase):
    def check(self, text, *words):
        with tempfile.NamedTemporaryFile("w", suffix=".conf", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            done = run("--check", file.name, *words)
            return done.returncode, (done.stdout + done.stderr).replace(file.name, "FILE")

    def refused(self, text, sentence, *words):
        code, said = self.check(text, *words)
        self.assertEqual((code, said), (3, f"vergenced: {sentence}\n"))

    def test_the_example_is_what_the_program_prints_and_is_good(self):
        with open(EXAMPLE, encoding="utf-8") as file:
            self.assertEqual(file.read(), run("--help-config").stdout,
                             "make it anew: vergenced --help-config > daemon/vergenced.conf")
        done = run("--check", EXAMPLE)
        self.assertEqual((done.returncode, done.stdout), (0, f"{EXAMPLE}: good\n"), done.stderr)

    def test_errors_are_reported_with_their_line(self):
        self.refused("\n# x\nprofil = rig\n",
                     'FILE:3: there is no key "profil"; did you mean "profile"?')
        self.refused("profile = dome\n", 'FILE:1: profile "dome": expected is one of: rig '
                     "two-cameras two-cameras-lens, or the name of a file that ends in .profile")
        self.refused("socket\n", 'FILE:1: "socket": expected is key = value')
        self.refused("socket =   # none\n", "FILE:1: socket: the value is missing")
        self.refused("socket =#none\n", "FILE:1: socket: the value is missing")
        self.refused("clients = 0\n", "FILE:1: clients 0 is out of range: from 1 to 32")
        self.refused("clients = many\n",
                     'FILE:1: clients "many" is no whole number: expected is 1 to 32')
        self.refused("rig.width_px = 99999", "FILE:1: rig.width_px 99999 is out of range: from 16 "
                     "to 16384 px")
        self.refused("queue = 3\nqueue = 4\n", "FILE:2: queue was set in line 1 already")
        self.refused("confine = maybe\n", 'FILE:1: confine "maybe": expected is one of: no yes')
        self.refused("backend = simulator\n",
                     'FILE:1: backend "simulator": expected is linux, sim unix:PATH, sim '
                     "tcp:HOST:PORT or replay DIRECTORY")
        self.refused("rig.frame_us = 5000\nprofile = rig\n",
                     "FILE:2: profile must stand above rig.frame_us (line 1), which it would undo")
        self.refused("rig.lens_backlash_counts = 5\nrig.lenses = v1lc\n",
                     "FILE:2: rig.lenses must stand above rig.lens_backlash_counts (line 1), which "
                     "it would undo")
        self.refused("i2c = none\n", "FILE:1: i2c is none, but the profile rig needs it with "
                     "backend = linux")
        self.refused("files = " + 300 * "x", "FILE:1: files is too long: at most 255 characters")
        # The system's limit for sockets, less the four letters of the name before it listens.
        self.refused("socket = /" + 103 * "x", "FILE:1: socket is too long: at most 103 characters")
        self.refused(600 * "x", "FILE:1: the line is too long, or this is no text file")
        self.refused("\n = 3 # x\n", 'FILE:2: "= 3": the name of the key is missing')
        # A byte order mark is skipped at the beginning and does not change line numbers.
        self.refused("\ufeffprofile = rig\nclients = 0\n",
                     "FILE:2: clients 0 is out of range: from 1 to 32")

    def test_inconsistent_values_are_reported_with_their_range(self):
        for text, sentence in (
                ("rig.pan_least_urad = 10\nrig.pan_most_urad = 5\n",
                 "FILE:1: rig.pan_least_urad 10 does not go with rig.pan_most_urad 5: it must be a "
                 "number from -1525101 to 4 urad"),
                ("\nrig.pan_most_urad = -600000\n",
                 "FILE:2: rig.pan_most_urad -600000 does not go with rig.pan_least_urad -523599, "
                 "which must be a number from -1525101 to -600001 urad"),
                ("rig.lens_counts_per_s_focus = 0\n",
                 "FILE:1: rig.lens_counts_per_s_focus 0 does not go with rig.lenses v3lc: it must "
                 "be a number from 1 to 100000 counts/s"),
                ("rig.servo_right_least_q4 = 30000\n",
                 "FILE:1: rig.servo_right_least_q4 30000 does not go with "
                 "rig.servo_right_centre_q4 24000 and rig.servos yes: it must be a number from "
                 "9600 to 23999 us/16"),
                ("profile = two-cameras\nrig.bridge = yes\n",
                 "FILE:2: rig.bridge yes does not go with rig.bridge_address 0, which must be 44"),
                ("profile = two-cameras\nrig.servos = yes\n",
                 "FILE:2: rig.servos yes does not go with rig.bridge no: it must be no"),
                ("rig.bridge = no\n",
                 "FILE:1: rig.bridge no does not go with rig.servos yes, which must be no"),
                ("rig.width_px = 4000\n",
                 "FILE:1: rig.width_px 4000 does not go with rig.bridge yes: it must be an even "
                 "number from 16 to 2048 px"),
                ("profile = two-cameras\nrig.height_px = 481\n",
                 "FILE:2: rig.height_px 481 is wrong: it must be an even number from 16 to 16384 "
                 "px"),
                ("rig.watchdog_ms = 10\n",
                 "FILE:1: rig.watchdog_ms 10 does not go with rig.bridge yes: it must be a number "
                 "from 400 to 1500 ms"),
                ("rig.sensor_address_left = 94\n",
                 "FILE:1: rig.sensor_address_left 94 does not go with rig.sensor_address_right "
                 "94, which must be another one from 8 to 119"),
                ("faults = i2c.*@z\n",
                 'FILE:1: faults: fault "i2c.*@z": @ requires a number of calls'),
                ("faults = i2c.read@1=io\n",
                 'FILE:1: faults: fault "i2c.read@1=io": i2c: unknown operation "read" (expected '
                 "transfer, lines or *)"),
                ("faults = stor.save@1=io\n",
                 'FILE:1: faults: fault "stor.save@1=io": unknown part "stor" (expected i2c, left, '
                 "right, gpio, uart, store, watchdog or *)"),
                # Nor is one that the other settings leave out: its faults would never be seen.
                ("faults = watchdog.feed@1=io\n",
                 'FILE:1: faults: there is no part "watchdog" with watchdog none'),
                ("store = none\nfaults = left.take@1=io, store.save@1=full\n",
                 'FILE:2: faults: there is no part "store" with store none'),
                ("faults = right.take@1=io\n",
                 'FILE:1: faults: there is no part "right" with rig.bridge yes, behind which both '
                 'cameras are "left"'),
                ("faults = gpio.get@1=io\n",
                 'FILE:1: faults: there is no part "gpio" with no line of GPIO'),
                ("profile = two-cameras\nfaults = uart.read@1=io\n",
                 'FILE:2: faults: there is no part "uart" with rig.lenses fixed'),
                ("profile = two-cameras\nfaults = i2c.transfer@1=io\n",
                 'FILE:2: faults: there is no part "i2c" with rig.bridge no'),
                ("console_baud = 12345\n",
                 "FILE:1: console_baud 12345 is no speed of a serial line: there are 9600, 19200, "
                 "38400, 57600, 115200, 230400, 460800 and 921600 baud"),
                ("profile = two-cameras\nleft_camera = /dev/video0\nright_camera = /dev/video0\n",
                 "FILE:3: right_camera /dev/video0 is also left_camera: each needs one of its own"),
                ("left_camera = /dev/video1\nprofile = two-cameras\n",
                 "FILE:1: left_camera /dev/video1 is also right_camera: each needs one of its own"),
                ("reset_line = 4\nirq_line = 4\n",
                 "FILE:2: irq_line 4 is also reset_line: each needs one of its own"),
                ("irq_line = 4\ngpio_chip = none\n",
                 "FILE:2: gpio_chip is none, but a line of GPIO needs it with backend = linux"),
                ("profile = two-cameras\nrig.trigger = yes\n",
                 "FILE:2: trigger_line is none, but rig.trigger yes needs it with backend = linux"),
                ("rig.trigger = yes\ntrigger_line = 4\n",
                 "FILE:1: rig.trigger yes does not go with rig.bridge yes: it must be no"),
                ("trigger_line = 4\nreset_line = 4\n",
                 "FILE:1: trigger_line 4 is also reset_line: each needs one of its own"),
                ("profile = two-cameras\nrig.trigger = yes\ntrigger_line = 4\nrig.trigger_us = 99\n",
                 "FILE:4: rig.trigger_us 99 does not go with rig.trigger yes: it must be a number "
                 "from 100 to 1000000 us"),
                ("console = /dev/ttyS1\n",
                 "FILE:1: console /dev/ttyS1 is also lens_uart: each needs one of its own"),
                ("tcp_port = 0\n",
                 "FILE:1: tcp_port 0 is out of range: from 1 to 65535, or off"),
                ("irq_line = -1\n",
                 "FILE:1: irq_line -1 is out of range: from 0 to 1023, or none"),
                ("clients = 3\nsocket = none\n",
                 "FILE:2: socket, tcp_port and console are none: nobody could give a command"),
                ("store = none\nrestore = yes\n",
                 "FILE:2: restore yes needs a store, which is none: there is nothing to restore"),
                ("backend = sim unix\n",
                 'FILE:1: backend "sim unix": expected is linux, sim unix:PATH, sim tcp:HOST:PORT '
                 "or replay DIRECTORY")):
            with self.subTest(text):
                self.refused(text, sentence)

    def test_what_clients_may_replace_is_apart(self):
        with tempfile.TemporaryDirectory() as folder:
            os.mkdir(f"{folder}/real")
            os.symlink(f"{folder}/real", f"{folder}/link")
            files = f"files = {folder}/real/files\n"
            for text in (files + f"store = {folder}/real/files/store\n",
                         files + f"store = {folder}/real/files\n",
                         files + f"store = {folder}/real/../link/./files//store/\n",
                         files + f"store = {folder}/real/files/none/../store\n",
                         f"store = {folder}/link/files\n" + files.replace("files\n", "files/a\n"),
                         f"store = {folder}/link\n" + files,
                         files + f"tcp_token = {folder}/link/files/token\n"):
                with self.subTest(text):
                    code, said = self.check(text)
                    self.assertEqual((code, said.count("\n")), (3, 1), said)
                    self.assertRegex(said, "^vergenced: FILE:[12]: (store|files|tcp_token) .* is "
                                     "inside (store|files) ")
            for text in (files + f"store = {folder}/real/files2\n",
                         files + f"store = {folder}/real/files/../store\n",
                         files + f"tcp_token = {folder}/link/token\n", files + "store = none\n"):
                self.assertEqual(self.check(text), (0, "FILE: good\n"), text)

    def test_valid_settings(self):
        for text in ("", "# nothing\n\n", "  clients=2 # two\r\ntcp_port = off\n",
                     "profile = two-cameras\nrig.width_px = 1280\nrig.height_px = 720\n",
                     "backend = sim unix:/run/x.sock\nsocket = none\nconsole = stdio\nlog_level = debug",
                     "socket = none\ntcp_port = 1\n",
                     "reset_line = 0x11\ngpio_chip = /dev/gpiochip1\n",
                     "profile = two-cameras\nrig.trigger = yes\ntrigger_line = 4\n",
                     "\ufeffprofile = two-cameras\n", "\ufeff"):
            self.assertEqual(self.check(text), (0, "FILE: good\n"), text)

    def test_faults_of_what_is_there_are_good(self):
        for text in ("faults = i2c.transfer@5=i2c_nack,left.take@1=io,uart.*%0.1=io,store.save@1=full",
                     "faults = *.save@1=full\nstore = none\n",
                     "watchdog = /dev/watchdog\nfaults = watchdog.feed@1=io",
                     "reset_line = 4\nfaults = gpio.set@1=io",
                     "profile = two-cameras\ntrigger_line = 4\nfaults = gpio.set@1=io",
                     "backend = sim unix:x\nfaults = gpio.get@1=io",
                     "profile = two-cameras\nfaults = right.take@1=spoil"):
            self.assertEqual(self.check(text), (0, "FILE: good\n"), text)

    def test_pages_take_no_settings(self):
        for page in (["--help-config"], ["--help-profile", "rig"], ["--version"]):
            done = run(*page, "i2c=none")
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            self.assertRegex(done.stderr, f"^vergenced: {page[0]} .*settings: i2c=none\n$")

    def test_no_file(self):
        done = run("--check", "no/such.conf")
        self.assertEqual((done.returncode, done.stderr),
                         (3, "vergenced: no/such.conf: No such file or directory\n"))
        done = run("--config", "no/such.conf")
        self.assertEqual(done.returncode, 3)

    def test_the_command_line_changes_a_setting(self):
        done = run("clients=99")
        self.assertEqual((done.returncode, done.stderr),
                         (3, "vergenced: clients 99 is out of range: from 1 to 32\n"))
        done = run("clients")
        self.assertEqual((done.returncode, done.stderr),
                         (3, 'vergenced: "clients": expected is KEY=VALUE\n'))
        self.assertEqual(self.check("clients = 3\n", "clients=4"), (0, "FILE: good\n"))

    def test_a_command_line_follows_the_rules_of_a_file(self):
        for words, sentence in (
                (("queue=3", "queue=3"), "queue is given twice"),
                (("rig.width_px=640", "profile=rig"),
                 "profile must stand before rig.width_px, which it would undo"),
                (("rig.lens_backlash_counts=5", "rig.lenses=v1lc"),
                 "rig.lenses must stand before rig.lens_backlash_counts, which it would undo"),
                (("files=",), "files: the value is missing"),
                (("socket= ",), "socket: the value is missing"),
                (("=3",), '"=3": the name of the key is missing'),
                (("log=" + 600 * "x",), f'"log={36 * "x"}..." is longer than 511 characters'),
                (("log=" + 300 * "x",), "log is too long: at most 255 characters")):
            with self.subTest(words):
                self.refused("", sentence, *words)
        self.assertEqual(self.check("", "profile=rig", "rig.width_px=640", " socket = none ",
                                    "console=stdio"), (0, "FILE: good\n"))

    def test_a_profile_of_the_command_line_undoes_nothing_in_the_file(self):
        # No bridge supports frames this wide; the file's settings still apply.
        text = "profile = two-cameras\nrig.width_px = 4000\n"
        self.assertEqual(self.check(text), (0, "FILE: good\n"))
        self.refused(text, "FILE:2: rig.width_px 4000 does not go with rig.bridge yes: it must be "
                     "an even number from 16 to 2048 px", "profile=rig")
        self.assertEqual(self.check(text, "profile=rig", "rig.width_px=640"), (0, "FILE: good\n"))
        # The same for lenses; and a line is not wrong because of what is replaced.
        text = "rig.lens_backlash_counts = 5\n"
        self.assertEqual(self.check(text, "rig.lenses=v1lc"), (0, "FILE: good\n"))
        self.assertEqual(self.check("rig.width_px = 4000\n", "profile=two-cameras"),
                         (0, "FILE: good\n"))

    def test_file_and_command_line_are_checked_together(self):
        # A profile on the command line applies to the whole file.
        text = "right_camera = /dev/video0\n"
        self.assertEqual(self.check(text), (0, "FILE: good\n"))
        self.refused(text, "FILE:1: right_camera /dev/video0 is also left_camera: each needs one "
                     "of its own", "profile=two-cameras")
        text = "i2c = none\n"
        self.assertEqual(self.check(text, "profile=two-cameras"), (0, "FILE: good\n"))
        self.refused("reset_line = 4\n", "irq_line 4 is also reset_line: each needs one of its own",
                     "irq_line=4")

    def test_an_output_that_cannot_be_written(self):
        for words in (("--version",), ("--help",), ("--help-config",), ("--check", EXAMPLE)):
            with self.subTest(words), open("/dev/full", "w", encoding="ascii") as full:
                done = run(*words, stdout=full)
                self.assertEqual(
                    (done.returncode, done.stderr),
                    (1, "vergenced: writing to standard output failed: No space left on device\n"))


if __name__ == "__main__":
    unittest.main()
