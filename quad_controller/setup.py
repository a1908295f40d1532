# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_controller."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    extras={
        'physics': ['quad_hardware', 'quad_sim'],
    },
    programs=[
        'attach_contract = quad_controller.attach_contract:main',
        'check_policy = quad_controller.policy_check.main:main',
        'controller_node = quad_controller.nodes.controller_node:main',
        'replay_policy = quad_controller.recording:main',
    ],
    commands=[
        'quad-attach-contract = quad_controller.attach_contract:main',
        'quad-check-policy = quad_controller.policy_check.main:main',
        'quad-replay-policy = quad_controller.recording:main',
    ],
    package_data=['policies/*.onnx'],
)
