# SPDX-License-Identifier: Apache-2.0
"""Paths of the repository, and of the cache of the FPGA tools."""
import os
import zlib

FPGA = os.path.realpath(os.path.join(os.path.dirname(__file__), ".."))
ROOT = os.path.dirname(FPGA)
CACHE = os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "vergence")


def own_cache(name):
    """A folder in the cache for this checkout only: builds of two checkouts must not mix."""
    return os.path.join(CACHE, name, f"{zlib.crc32(ROOT.encode()):08x}")
