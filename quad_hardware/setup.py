# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_hardware."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    programs=[
        'calibrate = quad_hardware.calibration.main:main',
        'doctor = quad_hardware.doctor.main:main',
        'hardware_node = quad_hardware.nodes.hardware_node:main',
        'protocol = quad_hardware.protocol.page:main',
        'replay = quad_hardware.nodes.replay:main',
    ],
    extras={'first_motion': ['teleop']},  # whose evdev wants a compiler
    commands=[
        'xgo-calibrate = quad_hardware.calibration.main:main',
        'xgo-doctor = quad_hardware.doctor.main:main',
        'xgo-protocol = quad_hardware.protocol.page:main',
    ],
)
