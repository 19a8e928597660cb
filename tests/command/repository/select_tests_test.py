# SPDX-License-Identifier: Apache-2.0
"""tests/select_tests.py: which tests a change can break, and what is built for them."""
import os
import pathlib
import sys
import unittest

SOURCE = pathlib.Path(os.environ["VERGENCE_SOURCE"])
BUILD = str(pathlib.Path(os.environ["VERGENCE"]).parents[1])
sys.path.insert(0, str(SOURCE / "tests"))

import select_tests  # noqa: E402


class Selection(unittest.TestCase):
    def chosen(self, *paths):
        for path in paths:
            self.assertTrue((SOURCE / path).exists(), path)
        return select_tests.reasons(BUILD, list(paths))

    def test_a_source_leads_to_the_tests_that_are_linked_with_it_and_to_those_of_its_subject(self):
        for path, included, excluded in (
                ("firmware/focus/focus_search.c", ("unit/focus_search_test", "console/focus_curve_test"),
                 ("unit/match_test", "command/mesh_test")),
                ("calib/detect/detect_grid.cpp", ("unit/calib_detect_test", "command/calibrate_test"),
                 ("unit/focus_search_test", "console/update_test")),
                ("tools/host/info/info.cpp", ("command/info_test",), ("unit/crc_test", "rig/pair_test")),
                ("tests/command/pairs.py", ("command/mesh_test",), ("unit/crc_test",)),
                ("tests/unit/core/crc_test.cpp", ("unit/crc_test",), ("unit/math_test", "command/info_test")),
                ("tools/demo", ("command/readme_test",), ("unit/crc_test",))):
            chosen = self.chosen(path)
            for name in included:
                self.assertIn(name, chosen, path)
            for name in excluded:
                self.assertNotIn(name, chosen, path)

    def test_what_everything_needs_leads_to_most_tests(self):
        few, many = self.chosen("tools/host/info/info.cpp"), self.chosen("firmware/core/crc.c")
        self.assertGreater(len(many), 5 * len(few))

    def test_the_longest_are_left_where_all_would_take_more_than_minutes(self):
        found = {f"console/t{i}": "firmware/core/crc.c" for i in range(12)}
        found |= {"console/own": "tests/console/own.py", "console/new": "firmware/core/crc.c"}
        known = {f"console/t{i}": 10 * i for i in range(12)} | {"console/own": 900}
        longer = [f"console/t{i}" for i in (10, 11, 7, 8, 9)]  # than a minute each
        self.assertEqual(select_tests.left_out(found, known), longer)
        known |= {"console/t0": 60, "console/t1": 60, "console/t2": 60}
        self.assertEqual(set(select_tests.left_out(found, known)) - set(longer), {"console/t6"})

    def test_the_words_are_of_folders_that_exist(self):
        for folder in select_tests.WORDS:
            self.assertTrue((SOURCE / folder).is_dir(), folder)

    def test_only_what_the_tests_need_is_built(self):
        self.assertEqual(select_tests.targets(BUILD, "^unit/crc_test$"), ["tests/crc_test"])
        self.assertIn("tools/vergence", select_tests.targets(BUILD, "^command/info_test$"))
        self.assertNotIn("tools/simrig/simrig", select_tests.targets(BUILD, "^command/info_test$"))
        self.assertIn("tools/simrig/simrig-render", select_tests.targets(BUILD, "^simrig/zoom_adjust_test$"))
        self.assertIn("daemon/vergenced", select_tests.targets(BUILD, "^console/focus_curve_test$"))
        self.assertEqual(select_tests.targets(BUILD, "^hdl/map_test$"), [])


if __name__ == "__main__":
    unittest.main()
