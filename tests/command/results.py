# SPDX-License-Identifier: Apache-2.0
"""What a command has put into a folder of results."""
import os


def result_names(folder):
    """The names in the folder, sorted, without the hidden list of the files that are ours."""
    return sorted(name for name in os.listdir(folder) if name != ".vergence-files")
