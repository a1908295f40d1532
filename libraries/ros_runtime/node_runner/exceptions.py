# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that node_runner raises."""

from __future__ import annotations


class ParameterError(ValueError):
    """A parameter of a node is misspelt, or its value makes no sense.

    Scenarios: a text where a number belongs, a rate beyond its range, a choice that there is not.
    """
