# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_canopen."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    programs=[
        'canopen_joint_state_publisher = arm_canopen.nodes.joint_state_publisher:main',
        'master = arm_canopen.nodes.master:main',
        'replay = arm_canopen.nodes.replay:main',
        # names of before that keep working; the programs are those of canopen_tools and _sim
        'candump = arm_canopen.aliases:candump',
        'canopen = arm_canopen.aliases:canopen',
        'fake_slave = arm_canopen.aliases:fake_slave',
        'fake_slaves = arm_canopen.aliases:fake_slaves',
    ],
    package_data=['config/read/default_drive.eds'],
    folders=['eds'],
)
