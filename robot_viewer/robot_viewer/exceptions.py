# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that robot_viewer raises.

::

    ViewerError
    └── DescriptionError (ValueError)   a robot description cannot be used; says which element

A parameter of a node that is not usable raises ``node_runner.ParameterError``. Arguments of the
wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations


class ViewerError(Exception):
    """Root of all errors of this package."""


class DescriptionError(ViewerError, ValueError):
    """A robot description cannot be used.

    Scenarios: it is empty or no XML, a joint names a link that does not exist, two links have the
    same name, the joints make a loop, a number is no number.
    """
