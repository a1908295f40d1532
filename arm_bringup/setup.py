# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_bringup."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    extras={
        'motion': [
            'python3-numpy',
            'arm_model',
            'arm_planning',
            'arm_servo',
            'arm_trajectory',
        ],
        'ros': ['canopen_sim', 'canopen_tools', 'robot_viewer'],
    },
    programs=[
        'bringup = arm_bringup.bringup:main',
        'check = arm_bringup.check:main',
        'demo = arm_bringup.examples.wave:main',
        'motion_demo = arm_bringup.examples:motion_demo',
        'plan_demo = arm_bringup.examples:plan_demo',
    ],
    folders=['macros', 'robots/*'],
)
