# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exceptions of quad_controller.

::

    QuadControllerError
    ├── ParameterError (ValueError)     a parameter is out of range or invalid
    └── PolicyError (ValueError)        an ONNX policy does not fit this robot; names what differs

A robot description that is not that of a quadruped raises
:class:`quad_description.DescriptionError`. Requests that can be rejected while the robot runs (a
mode, a velocity) raise nothing: the response has the reason. Arguments of the wrong kind from a
*programmer* stay ``ValueError``.
"""

from __future__ import annotations

from typing import Any

from robot_primitives import settings_problem


class QuadControllerError(Exception):
    """Root of all errors of this package."""


class ParameterError(QuadControllerError, ValueError):
    """A parameter is out of range or invalid.

    Scenarios: a duty of 1.2, a height that the legs do not reach, a misspelt name.
    """


class PolicyError(QuadControllerError, ValueError):
    """A policy does not match this robot, or cannot be loaded.

    Scenarios: joints in the file that the robot lacks, another observation width, no metadata.
    """

    def __init__(self, message: str, reason: str = '') -> None:
        """Store the reason, by default the first line of the message."""
        # what is wrong in one line; the message may have a table
        self.reason = reason or message.partition('\n')[0]
        super().__init__(message)


class CheckError(QuadControllerError):
    """A policy could not be tested; this says nothing about the policy.

    Scenarios: no MuJoCo, the simulated robot was lost on a machine that is far too busy.
    """


def check_settings(values: Any, prefix: str = '') -> None:  # noqa: ANN401
    """Reject numbers outside of their ranges.

    Raises:
        ParameterError: A number is out of range; the message gives name and range.
    """
    if problem := settings_problem(values):
        raise ParameterError(prefix + problem)
