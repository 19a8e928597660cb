# SPDX-License-Identifier: Apache-2.0
"""The one kind of error that ends tools/board with a line."""


class Problem(Exception):
    """Something is missing or wrong; the text says what, and what to do."""
