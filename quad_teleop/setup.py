# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_teleop."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    programs=[
        'teleop_keyboard = quad_teleop.nodes.teleop:teleop_keyboard',
        'teleop_gamepad = quad_teleop.nodes.teleop:teleop_gamepad',
        'twist_mux = quad_teleop.nodes.twist_mux:main',
    ],
    folders=['config'],
)
