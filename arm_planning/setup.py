# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_planning."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    programs=[
        'move_group = arm_planning.nodes.move_group:main',
        'srdf = arm_planning.srdf:srdf',  # a program of arm_bringup
    ],
)
