# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that quad_description raises.

::

    DescriptionError (ValueError)     a description cannot be made, or a URDF is not usable
    └── PresetError                   there is no such preset; lists what there is
"""

from __future__ import annotations


class DescriptionError(ValueError):
    """A description cannot be made, or a URDF that was handed in is not usable.

    Scenarios: a trunk without mass, malformed XML, a movable joint without limits.
    """


class PresetError(DescriptionError):
    """There is no such preset.

    Scenarios: a name misspelt, a preset of another robot.
    """
