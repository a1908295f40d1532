# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that quad_description raises.

::

    DescriptionError (ValueError)     of urdf_reader: a description cannot be made or used
    └── PresetError                   unknown preset; lists the known ones
"""

from __future__ import annotations

from urdf_reader import DescriptionError


class PresetError(DescriptionError):
    """There is no such preset.

    Scenarios: a name misspelt, a preset of another robot.
    """
