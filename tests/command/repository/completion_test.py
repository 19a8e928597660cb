# SPDX-License-Identifier: Apache-2.0
"""Tab completion of vergence and vergenced in bash."""
import os
import pty
import re
import select
import socket
import subprocess
import tempfile
import time
import unittest

from pairs import VERGENCE, run

SCRIPT = os.path.join(os.path.dirname(VERGENCE), "install", "completion.bash")
TIMEOUT_S = 60
# Like bash: the last word ends at the cursor, and : and = are separate words.
ASK = """
source "$1" || exit
COMP_LINE=$2 COMP_POINT=${#2}
read -ra COMP_WORDS <<<"${2//[:=]/ & }"
[[ $2 != *' ' ]] || COMP_WORDS+=('')
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
function=$(complete -p "${COMP_WORDS[0]}") && function=${function##*-F } && function=${function%% *}
"$function" "${COMP_WORDS[0]}" "${COMP_WORDS[-1]}" "${COMP_WORDS[-2]}"
[[ ${#COMPREPLY[@]} -eq 0 ]] || printf '%s\\n' "${COMPREPLY[@]}"
"""


class Completion(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def offered(self, line, **environment):
        done = subprocess.run(["bash", "--norc", "-c", ASK, "ask", SCRIPT, line], cwd=self.folder,
                              capture_output=True, text=True, timeout=TIMEOUT_S,
                              env={**os.environ, **environment})
        self.assertEqual((done.returncode, done.stderr), (0, ""), line)
        return done.stdout.split()

    def test_commands(self):
        commands = re.findall(r"^  ([a-z]+)  ", run("--help").stdout, re.M)
        self.assertEqual(sorted(self.offered("vergence ")), sorted(commands + ["help"]))
        self.assertEqual(sorted(self.offered("vergence help ")), sorted(commands + ["connect"]))
        self.assertEqual(self.offered("vergence rec"), ["reconstruct"])
        self.assertEqual(self.offered("vergence help calibrate "), ["capture"])
        self.assertIn("--no-sweep", self.offered("vergence calibrate capture --"))
        self.assertIn("--connect", self.offered("vergence --"))

    def test_options_and_their_values(self):
        page = run("reconstruct", "--help").stdout
        options = re.findall(r"^    (--\S+)", page, re.M)
        self.assertEqual(sorted(self.offered("vergence reconstruct -")), sorted(options))
        self.assertEqual(self.offered("vergence reconstruct a b --pres"), ["--preset"])
        choices = re.split(", | or ", re.search(r"--preset.*?\n +\(([a-z, ]*)\)\n", page, re.S)[1])
        self.assertEqual(self.offered("vergence reconstruct a b --preset "), choices)
        self.assertEqual(self.offered("vergence reconstruct --preset f"), ["fast"])
        # Bash completes only what follows the =.
        self.assertEqual(self.offered("vergence reconstruct --preset=f"), ["fast"])
        # A flag has no value: here comes another option, or a file.
        self.assertEqual(self.offered("vergence reconstruct --rectified --pres"), ["--preset"])

    def test_files_are_left_to_bash(self):
        for line in ("vergence reconstruct ", "vergence reconstruct le", "vergence info --conve x ",
                     "vergence reconstruct a b --calibration ", "vergence reconstruct --pair ",
                     "vergence nosuch ", "vergenced --config "):
            self.assertEqual(self.offered(line), [], line)

    def test_nothing_typed_is_carried_out(self):
        self.offered("vergence $(touch${IFS}evil) `touch${IFS}evil` --x a[$(touch${IFS}evil)] --")
        self.offered("vergence reconstruct a[$(touch${IFS}evil)] --out=$(touch${IFS}evil)")
        self.assertEqual(os.listdir(self.folder), [])

    def test_settings_of_the_daemon(self):
        settings = self.offered("vergenced ")
        self.assertIn("backend=", settings)
        self.assertIn("rig.name=", settings)
        self.assertEqual(self.offered("vergenced log_level=w"), ["warning"])
        self.assertEqual(self.offered("vergenced restore="), ["no", "yes"])
        self.assertIn("--help-config", self.offered("vergenced --"))

    def test_addresses(self):
        runtime = os.path.join(self.folder, "run")
        os.makedirs(os.path.join(runtime, "vergence"))
        listeners = [socket.socket(socket.AF_UNIX) for _ in range(2)]
        for listener, place in zip(listeners, ("rig.sock", "run/vergence/vergenced.sock")):
            self.addCleanup(listener.close)
            listener.bind(os.path.join(self.folder, place))
        own = os.path.join(runtime, "vergence", "vergenced.sock")
        found = self.offered("vergence --connect ", XDG_RUNTIME_DIR=runtime)
        self.assertLessEqual({"unix:rig.sock", f"unix:{own}", "tcp:localhost:"}, set(found))
        self.assertIn("bringup", found)
        self.assertEqual(self.offered("vergence --connect unix:ri"), ["rig.sock"])
        self.assertEqual(self.offered("vergence --connect=unix:ri"), ["rig.sock"])

    def test_commands_of_an_instrument(self):
        begin = "vergence --connect unix:rig.sock "
        commands = self.offered(begin)
        self.assertLessEqual({"bringup", "capture", "pan", "fetch", "replay"}, set(commands))
        self.assertEqual(self.offered(begin + "bri"), ["bringup"])
        self.assertEqual(self.offered(begin + "--js"), ["--json"])
        for line in (begin + "pan ", begin + "--json pan ", "vergence --connect pan "):
            self.assertEqual(self.offered(line), ["side=", "right="])
        self.assertEqual(self.offered(begin + "pan 3 side=l"), ["left"])
        self.assertEqual(self.offered(begin + "calibration s"), ["show", "set"])
        self.assertEqual(self.offered(begin + "pan -"), [])

    def test_a_user_presses_tab(self):
        pid, fd = pty.fork()
        if pid == 0:
            os.chdir(self.folder)
            os.environ.update(PS1="> ", TERM="dumb", INPUTRC="/dev/null")
            os.execlp("bash", "bash", "--norc", "--noprofile", "-i")
        self.addCleanup(os.waitpid, pid, 0)
        self.addCleanup(os.close, fd)
        shown = ""
        for typed, expected in ((f"vergence() {{ echo \"got $*.\"; }}; source {SCRIPT}; echo rea''dy\n",
                                 "ready"),
                                ("vergence recon\t--pres\tstand\t\n",
                                 "got reconstruct --preset standard.")):
            os.write(fd, typed.encode())
            end = time.monotonic() + TIMEOUT_S
            while expected not in shown:
                self.assertTrue(select.select([fd], [], [], max(0, end - time.monotonic()))[0], shown)
                shown += os.read(fd, 4096).decode(errors="replace")


if __name__ == "__main__":
    unittest.main()
