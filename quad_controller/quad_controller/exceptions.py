# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that quad_controller raises.

::

    QuadControllerError
    ├── ParameterError (ValueError)     a parameter is outside of what makes sense
    └── PolicyError (ValueError)        an ONNX policy does not fit this robot; names what differs

A robot description that is no quadruped's raises :class:`quad_description.DescriptionError`.
Requests that can be refused while the robot runs (a mode, a velocity) raise nothing: they are
answered with a reason. Arguments of the wrong kind from a *programmer* stay ``ValueError``.
"""

from __future__ import annotations

from typing import Any

from robot_primitives import settings_problem


class QuadControllerError(Exception):
    """Root of all errors of this package."""


class ParameterError(QuadControllerError, ValueError):
    """A parameter is outside of what makes sense.

    Scenarios: a duty of 1.2, a height that the legs do not reach, a misspelt name.
    """


class PolicyError(QuadControllerError, ValueError):
    """A policy does not fit this robot, or cannot be loaded.

    Scenarios: joints in the file that the robot lacks, another observation width, no metadata.
    """

    def __init__(self, message: str, reason: str = '') -> None:
        """Keep the reason beside the message, whose first line it is by default."""
        # what is wrong in one line; the message may have a table
        self.reason = reason or message.partition('\n')[0]
        super().__init__(message)


class CheckError(QuadControllerError):
    """A policy could not be tried; it says nothing about the policy.

    Scenarios: no MuJoCo, the simulated robot was lost on a machine that is far too busy.
    """


def check_settings(values: Any, prefix: str = '') -> None:  # noqa: ANN401
    """Refuse numbers outside of their ranges.

    Raises:
        ParameterError: The message has name and range.
    """
    if problem := settings_problem(values):
        raise ParameterError(prefix + problem)
