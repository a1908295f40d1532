# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of robot_viewer."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    extras={
        'page': [
            'python3-numpy',
            'python3-trimesh-pip',
            'python3-viser-pip',
            'python3-websockets',
            'python3-zstandard',
        ],
    },
    programs=[
        'foxglove_bridge = robot_viewer.nodes.foxglove_bridge:main',
        'robot_state_publisher = robot_viewer.nodes.robot_state_publisher:main',
        'state = robot_viewer.nodes.state:main',
        'web_viewer = robot_viewer.nodes.web_viewer:main',
    ],
    package_data=['page/overlay.html'],
)
