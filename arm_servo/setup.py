# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_servo."""

from pathlib import Path
import runpy

SHARED = Path(__file__).resolve().parents[1] / 'tools' / 'setup_package.py'
runpy.run_path(str(SHARED))['setup_package'](
    extras={
        'ros': ['teleop'],
    },
    programs=[
        'motion_node = arm_servo.ros.motion_node:main',
        'motion_controller = arm_servo.ros.motion_node:motion_controller',
        'motion_master = arm_servo.ros.motion_node:motion_master',
        'servo_node = arm_servo.ros.motion_node:servo_node',
        'trajectory_controller = arm_servo.ros.motion_node:trajectory_controller',
        'servo_gamepad = arm_servo.teleop.servo_gamepad:main',
        'servo_keyboard_input = arm_servo.teleop.servo_keyboard_input:main',
    ],
)
