# SPDX-License-Identifier: Apache-2.0
"""tools/simrig/control as a user runs it."""
import subprocess
import unittest

from simrig_client import FILES, TIMEOUT_S, SCENE, Bench


class Control(Bench):
    def control(self, *words):
        return subprocess.run([FILES / "control", *words], capture_output=True, text=True,
                              timeout=TIMEOUT_S, check=False)

    def refuse(self, code, words, *texts):
        done = self.control(*words)
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (code, "", 1),
                         done.stderr)
        for text in texts:
            self.assertIn(text, done.stderr)

    def test_commands_are_carried_out_in_order(self):
        for where in (None, "tcp:0"):
            rig = self.start(where=where)
            done = self.control(rig.where, "fault lens left zoom jam", "status")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertIn("zoom", done.stdout)
            self.refuse(1, (rig.where, "fault lens left zoom eat"), "control: fault lens", "eat")

    def test_no_foreign_file_is_shown(self):
        rig = self.start()
        for number, text in enumerate((
                "root:secret:19000:0:99999:7:::\n", "secret: 1\n", "- secret\n", "*secret\n",
                SCENE.replace("bounce_lux: 0", "bounce_lux: secret"),
                SCENE.replace("print: {kind: board", "print: {kind: secret"),
                SCENE.replace("material: print", "material: secret"),
                SCENE.replace("- sheet:", "- secret:"))):
            path = self.folder / f"foreign{number}.yaml"
            path.write_text(text)
            with self.subTest(text):
                for command in (f"scene {path}", f"at 1 scene {path}"):
                    done = self.control(rig.where, command)
                    self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1))
                    self.assertIn(f"{path}:", done.stderr)
                    self.assertNotIn("secret", done.stderr)

    def test_no_server(self):
        self.refuse(3, (f"unix:{self.folder}/none", "status"), "no simulated rig")
        self.refuse(3, ("tcp:1", "status"), "no simulated rig")

    def test_wrong_usage(self):
        for words in ((), ("status",), ("unix:rig.sock",), ("rig.sock", "status")):
            self.refuse(2, words, "see --help")
        self.assertEqual(self.control("--help").returncode, 0)


if __name__ == "__main__":
    unittest.main()
