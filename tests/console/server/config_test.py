# SPDX-License-Identifier: Apache-2.0
"""Settings: errors name their line; units; the notation of older versions; the example in the tree has
all keys."""
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

    def refused(self, text, begin, *parts, words=()):
        """One line, which starts with `begin` and has all of `parts`."""
        code, output_text = self.check(text, *words)
        self.assertEqual((code, output_text.count("\n")), (3, 1), output_text)
        self.assertEqual(output_text[:len("vergenced: " + begin)], "vergenced: " + begin)
        for part in parts:
            self.assertIn(part, output_text)

    def test_the_example_is_what_the_program_prints_and_is_good(self):
        with open(EXAMPLE, encoding="utf-8") as file:
            self.assertEqual(file.read(), run("--help-config").stdout,
                             "regenerate it: vergenced --help-config > daemon/vergenced.conf")
        done = run("--check", EXAMPLE)
        self.assertEqual((done.returncode, done.stdout), (0, f"{EXAMPLE}: good\n"), done.stderr)

    def test_errors_name_their_line(self):
        for text, *parts in (
                ("\n# x\nprofil = rig\n", 'FILE:3: unknown key "profil"', '"profile"'),
                ("profile = dome\n", "FILE:1: ", 'profile "dome"', "rig two-cameras two-cameras-lens",
                 ".profile"),
                ("socket\n", "FILE:1: ", "key = value"),
                ("socket =   # none\n", "FILE:1: socket: value missing"),
                ("socket =#none\n", "FILE:1: socket: value missing"),
                ("clients = 0\n", "FILE:1: clients = 0: out of range", "1 to 32)"),
                ("clients = many\n", "FILE:1: clients = many: not an integer", "1 to 32)"),
                ("rig.width = 99999 px", "FILE:1: rig.width = 99999 px: out of range",
                 "16 to 16384 px)"),
                ("queue = 3\nqueue = 4\n", "FILE:2: duplicate key queue", "line 1"),
                ("confine = maybe\n", "FILE:1: ", 'confine "maybe"', "no yes"),
                ("backend = simulator\n", "FILE:1: ", 'backend "simulator"', "sim unix:PATH"),
                ("[rig]\nwidth = 640 px\nrig.width = 640 px\n", 'FILE:3: unknown key "rig.rig.width"'),
                ("rig.width = 640 px\n[rig]\nwidth = 640 px\n", "FILE:3: duplicate key rig.width", "line 1"),
                ("[rigs]\nwidth = 640 px\n", 'FILE:2: unknown key "rigs.width"', '"rig.width"'),
                ("[rig\n", "FILE:1: ", "key = value"),
                ("i2c = none\n", "FILE:1: ", "profile rig", '"i2c"', "backend = linux"),
                ("files = " + 300 * "x", "FILE:1: line too long", "196"),
                # The longest path of a socket, less the four letters that it has until it listens.
                ("socket = /" + 103 * "x", "FILE:1: socket: too long", "103"),
                (600 * "x", "FILE:1: line too long"),
                ("\n = 3 # x\n", 'FILE:2: "= 3": key missing'),
                # A byte order mark at the start is skipped, and adds no line.
                ("\ufeffprofile = rig\nclients = 0\n", "FILE:2: clients = 0: out of range")):
            with self.subTest(text[:60]):
                self.refused(text, *parts)

    def test_numbers_have_the_units_that_are_expected(self):
        for text, *parts in (
                ("rig.pan_min = -30\n", "FILE:1: rig.pan_min = -30: unit missing (expected deg)"),
                ("rig.pan_min = -30 us\n", "FILE:1: rig.pan_min = -30 us: unknown unit",
                 "expected deg"),
                ("rig.pan_min = -95 deg\n", "FILE:1: rig.pan_min = -95 deg: out of range",
                 "-90 to 90 deg"),
                ("rig.pan_min = left deg\n", "FILE:1: rig.pan_min = left deg: not a number",
                 "-90 to 90 deg"),
                ("rig.width = 640.5 px\n", "FILE:1: rig.width = 640.5 px: not a multiple of 1 px"),
                ("rig.servo_left_min = 700.03 us\n", "FILE:1: rig.servo_left_min = 700.03 us: ",
                 "multiple of 0.0625 us"),
                ("reader_timeout = 500 ms\n", "FILE:1: reader_timeout = 500 ms: ",
                 "multiple of 1 s"),
                ("rig.bridge_address = 2c\n", "FILE:1: rig.bridge_address = 2c: not an integer",
                 "0x00 to 0x77"),
                ("rig.bridge_address = 0x99\n", "FILE:1: rig.bridge_address = 0x99: out of range",
                 "0x00 to 0x77"),
                ("clients = 3 s\n", "FILE:1: clients = 3 s: not an integer")):
            with self.subTest(text):
                self.refused(text, *parts)
        for text in ("rig.pan_min = -30 deg\nrig.pan_max = 29.5deg\n", "reader_timeout = 2000 ms\n",
                     "rig.sensor_clock = 24000 kHz\n", "rig.skew_limit = 0.5 s\n",
                     "rig.bridge_address = 0x2c\n", "rig.servo_left_centre = 1500.0625 us\n",
                     "rig.servo_left_scale = 10.25 us/deg\n", "rig.lens_zoom_step = 0.42 %\n"):
            self.assertEqual(self.check(text), (0, "FILE: good\n"), text)

    def test_the_notation_of_older_versions_is_read(self):
        text = ("profile = rig\n\nrig.pan_least_urad = -500000\nrig.pan_most_urad = 400000 # x\n"
                "rig.width_px = 0x500\nreader_timeout = 7\nrig.sensor_address_left = 92\n"
                "rig.frame_us = 3300\n")
        now = (("3: rig.pan_least_urad", "rig.pan_min = -28.6479 deg"),
               ("4: rig.pan_most_urad", "rig.pan_max = 22.9183 deg"),
               ("5: rig.width_px", "rig.width = 1280 px"),
               ("6: reader_timeout", "reader_timeout = 7 s"),
               ("7: rig.sensor_address_left", "rig.sensor_address_left = 0x5c"),
               ("8: rig.frame_us", "rig.frame_interval = 3.3 ms"))
        code, output_text = self.check(text)
        lines = output_text.splitlines()
        self.assertEqual((code, len(lines)), (0, 1 + len(now)), output_text)
        self.assertIn("FILE: good", lines)
        for begin, write in now:
            self.assertEqual(len([line for line in lines if line.startswith(f"FILE:{begin} ")
                                  and line.endswith(f": write {write}")]), 1, output_text)
        self.assertEqual(self.check("profile = rig\n" + "".join(f"{line}\n" for _, line in now)),
                         (0, "FILE: good\n"))
        code, output_text = self.check("", "rig.width_px=640", "stuck_after=30")
        self.assertEqual((code, output_text.count(": write ")), (0, 2), output_text)
        # It follows the same rules.
        for text, *parts in (
                ("rig.width_px = 99999\n", "FILE:1: rig.width_px = 99999: out of range"),
                ("rig.width_px = 640 px\n", "FILE:1: rig.width_px = 640 px: not an integer"),
                ("rig.width_px = 640\nrig.width = 640 px\n", "FILE:2: duplicate key rig.width", "line 1"),
                ("width_px = 640\n", 'FILE:1: unknown key "width_px"')):
            with self.subTest(text):
                code, output_text = self.check(text)
                self.assertEqual(code, 3)
                for part in parts:
                    self.assertIn(part, output_text.splitlines()[-1])

    def test_conflicts_name_the_expected_range(self):
        for text, *parts in (
                ("rig.pan_min = 10 deg\nrig.pan_max = 5 deg\n",
                 "FILE:1: rig.pan_min = 10 deg conflicts with rig.pan_max = 5 deg ", "-87.38185 to 4.99"),
                ("\nrig.pan_max = -40 deg\n",
                 "FILE:2: rig.pan_min = -30 deg conflicts with rig.pan_max = -40 deg "),
                ("rig.lens_focus_speed_min = 0 counts/s\n",
                 "FILE:1: rig.lens_focus_speed_min = 0 counts/s conflicts with rig.lenses = v3lc ",
                 "1 to 100000 counts/s)"),
                ("rig.servo_right_min = 1875 us\n",
                 "FILE:1: rig.servo_right_min = 1875 us conflicts with rig.servo_right_centre = 1500 us "
                 "and rig.servos = yes ", "600 to 1499.9375 us)"),
                ("profile = two-cameras\nrig.bridge = yes\n",
                 "FILE:2: rig.bridge_address = 0x00 conflicts with rig.bridge = yes ", "0x2c)"),
                ("profile = two-cameras\nrig.servos = yes\n",
                 "FILE:2: rig.servos = yes conflicts with rig.bridge = no ", "(expected no)"),
                ("rig.bridge = no\n", "FILE:1: rig.servos = yes conflicts with rig.bridge = no ",
                 "(expected no)"),
                ("rig.width = 4000 px\n",
                 "FILE:1: rig.width = 4000 px conflicts with rig.bridge = yes ",
                 "an even number, 16 to 2048 px)"),
                ("profile = two-cameras\nrig.height = 481 px\n", "FILE:2: rig.height = 481 px: ",
                 "an even number, 16 to 16384 px)"),
                ("rig.servo_watchdog = 10 ms\n",
                 "FILE:1: rig.servo_watchdog = 10 ms conflicts with rig.bridge = yes ",
                 "400 to 1500 ms)"),
                ("rig.sensor_address_left = 0x5e\n", "FILE:1: rig.sensor_address_right = 0x5e conflicts "
                 "with rig.sensor_address_left = 0x5e ", "0x08 to 0x77"),
                ("faults = i2c.*@z\n", "FILE:1: faults: ", '"i2c.*@z"'),
                ("faults = i2c.read@1=io\n", "FILE:1: faults: ", '"i2c.read@1=io"', '"read"',
                 "transfer"),
                ("faults = stor.save@1=io\n", "FILE:1: faults: ", '"stor"', "watchdog"),
                # A part that the settings do not use, whose faults would never occur.
                ("faults = watchdog.feed@1=io\n", 'FILE:1: faults: no part "watchdog"',
                 "watchdog = none"),
                ("store = none\nfaults = left.take@1=io, store.save@1=full\n",
                 'FILE:2: faults: no part "store"', "store = none"),
                ("faults = right.take@1=io\n", 'FILE:1: faults: no part "right"', "rig.bridge = yes",
                 '"left"'),
                ("faults = gpio.get@1=io\n", 'FILE:1: faults: no part "gpio"'),
                ("profile = two-cameras\nfaults = uart.read@1=io\n",
                 'FILE:2: faults: no part "uart"', "rig.lenses = fixed"),
                ("profile = two-cameras\nfaults = i2c.transfer@1=io\n",
                 'FILE:2: faults: no part "i2c"', "rig.bridge = no"),
                ("console_baud = 12345\n", "FILE:1: console_baud = 12345: ", "115200"),
                ("profile = two-cameras\nleft_camera = /dev/video0\nright_camera = /dev/video0\n",
                 "FILE:3: left_camera and right_camera are both /dev/video0"),
                ("left_camera = /dev/video1\nprofile = two-cameras\n",
                 "FILE:1: left_camera and right_camera are both /dev/video1"),
                ("reset_line = 4\nirq_line = 4\n", "FILE:2: reset_line and irq_line are both 4"),
                ("irq_line = 4\ngpio_chip = none\n", "FILE:2: ", "GPIO line", '"gpio_chip"'),
                ("profile = two-cameras\nrig.trigger = yes\n", "FILE:2: ", "rig.trigger = yes",
                 '"trigger_line"'),
                ("rig.trigger = yes\ntrigger_line = 4\n",
                 "FILE:1: rig.trigger = yes conflicts with rig.bridge = yes ", "(expected no)"),
                ("trigger_line = 4\nreset_line = 4\n",
                 "FILE:1: reset_line and trigger_line are both 4"),
                ("profile = two-cameras\nrig.trigger = yes\ntrigger_line = 4\n"
                 "rig.trigger_pulse = 0.099 ms\n",
                 "FILE:4: rig.trigger_pulse = 0.099 ms conflicts with rig.trigger = yes ",
                 "0.1 to 1000 ms)"),
                ("console = /dev/ttyS1\n", "FILE:1: lens_uart and console are both /dev/ttyS1"),
                ("tcp_port = 0\n", "FILE:1: tcp_port = 0: out of range", "1 to 65535), or off"),
                *((f"tcp_port = 9\ntcp_network = {network}\n", f"FILE:2: tcp_network = {network}: "
                   "not a network", "192.0.2.0/24")
                  for network in ("192.0.2.0", "192.0.2.0/", "192.0.2.0/7", "192.0.2.0/33",
                                  "192.0.2.1/24", "192.0.2.0/24x", "0.0.0.0/0", "192.0.2/24",
                                  "300.0.2.0/24", "::/64", "192.0.2.0 /24")),
                ("tcp_network = 192.0.2.0/24\n",
                 "FILE:1: tcp_network = 192.0.2.0/24 requires", '"tcp_port"'),
                ("irq_line = -1\n", "FILE:1: irq_line = -1: out of range", "0 to 1023), or none"),
                ("clients = 3\nsocket = none\n", "FILE:2: ", "socket, tcp_port or console"),
                ("store = none\nrestore = yes\n", "FILE:2: restore = yes ", '"store"'),
                ("backend = sim unix\n", "FILE:1: ", '"sim unix"', "sim unix:PATH")):
            with self.subTest(text):
                self.refused(text, *parts)

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
                    code, output_text = self.check(text)
                    self.assertEqual((code, output_text.count("\n")), (3, 1), output_text)
                    self.assertRegex(output_text, "^vergenced: FILE:[12]: (store|files|tcp_token) .* is "
                                     "inside (store|files) ")
            for text in (files + f"store = {folder}/real/files2\n",
                         files + f"store = {folder}/real/files/../store\n",
                         files + f"tcp_token = {folder}/link/token\n", files + "store = none\n"):
                self.assertEqual(self.check(text), (0, "FILE: good\n"), text)

    def test_valid_settings(self):
        for text in ("", "# nothing\n\n", "  clients=2 # two\r\ntcp_port = off\n",
                     "profile = two-cameras\nrig.width = 1280 px\nrig.height = 720 px\n",
                     "backend = sim unix:/run/x.sock\nsocket = none\nconsole = stdio\nlog_level = debug",
                     "socket = none\ntcp_port = 1\n",
                     "tcp_network = 198.51.100.7/32\ntcp_port = 1\n",
                     "tcp_network = none\ntcp_port = off\n",
                     # In any order, in sections, with other comments.
                     "rig.width = 1280 px\nprofile = two-cameras\n",
                     "rig.lens_backlash = 5 counts\nrig.lenses = v1lc\n",
                     "profile = two-cameras ; two\n[rig] # of it\nwidth: 1280 px\n; end\n",
                     "[rig]\npan_min = -3 deg\n",
                     "clients = 3 # " + 600 * "x",
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

    def test_the_manual(self):
        manual = os.path.join(os.environ["VERGENCE_SOURCE"], "daemon", "manual.md")
        with open(manual, encoding="utf-8") as file:
            licence, text = file.read().split("\n", 1)
        self.assertIn("SPDX", licence)
        self.assertEqual(run("--manual").stdout, text)

    def test_lens_controllers(self):
        lines = run("--help-lenses").stdout.splitlines()
        self.assertEqual(lines[0], "fixed: no motors")
        self.assertRegex(lines[1], r"^v3lc: .*two lenses \(serial port, 9600 baud; "
                                   r"zoom 300 to 850 counts; focus .*; iris 300 to 850 counts\)$")
        for line in lines:
            name = line.split(":")[0]
            self.assertEqual(self.check(f"rig.lenses = {name}\n"), (0, "FILE: good\n"))

    def test_no_file(self):
        done = run("--check", "no/such.conf")
        self.assertEqual((done.returncode, done.stderr),
                         (3, "vergenced: no/such.conf: No such file or directory\n"))
        done = run("--config", "no/such.conf")
        self.assertEqual(done.returncode, 3)

    def test_the_command_line_changes_a_setting(self):
        done = run("clients=99")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1))
        self.assertIn("clients = 99: out of range", done.stderr)
        done = run("clients")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1))
        self.assertIn("KEY=VALUE", done.stderr)
        self.assertEqual(self.check("clients = 3\n", "clients=4"), (0, "FILE: good\n"))

    def test_a_command_line_follows_the_rules_of_a_file(self):
        for words, *parts in (
                (("queue=3", "queue=3"), "duplicate key queue"),
                (("files=",), "files: value missing"),
                (("socket= ",), "socket: value missing"),
                (("=3",), '"=3": key missing'),
                (("log=" + 600 * "x",), f'"log={36 * "x"}..."', "511"),
                (("log=" + 300 * "x",), "log: too long", "255")):
            with self.subTest(words):
                self.refused("", *parts, words=words)
        self.assertEqual(self.check("", "profile=rig", "rig.width=640px", " socket = none ",
                                    "console=stdio"), (0, "FILE: good\n"))

    def test_file_and_command_line_are_checked_together(self):
        # A profile on the command line applies to the whole file.
        text = "right_camera = /dev/video0\n"
        self.assertEqual(self.check(text), (0, "FILE: good\n"))
        self.refused(text, "FILE:1: left_camera and right_camera are both /dev/video0",
                     words=("profile=two-cameras",))
        text = "i2c = none\n"
        self.assertEqual(self.check(text, "profile=two-cameras"), (0, "FILE: good\n"))
        self.refused("reset_line = 4\n", "reset_line and irq_line are both 4",
                     words=("irq_line=4",))

    def test_an_output_that_cannot_be_written(self):
        for words in (("--version",), ("--help",), ("--help-config",), ("--check", EXAMPLE)):
            with self.subTest(words), open("/dev/full", "w", encoding="ascii") as full:
                done = run(*words, stdout=full)
                self.assertEqual(
                    (done.returncode, done.stderr),
                    (1, "vergenced: writing to standard output failed: No space left on device\n"))


if __name__ == "__main__":
    unittest.main()
