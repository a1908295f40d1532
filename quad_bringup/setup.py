# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_bringup."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    extras={
        'ros': ['quad_hardware', 'quad_sim', 'quad_teleop', 'robot_viewer'],
    },
    programs=[
        'bringup = quad_bringup.bringup:main',
        'demo = quad_bringup.walk:main',
    ],
    folders=['launch', 'view'],
)
