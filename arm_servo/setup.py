# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_servo."""

from setuptools import find_packages, setup

setup(
    name='arm_servo',
    version='0.1.0',
    packages=find_packages(include=['arm_servo', 'arm_servo.*']),
    package_data={'arm_servo': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/arm_servo']),
        ('share/arm_servo', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Jogging and trajectories of an arm on one motion core',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'motion_controller = arm_servo.ros.motion_controller:main',
            'motion_master = arm_servo.ros.motion_master:main',
            'servo_node = arm_servo.ros.servo_node:main',
            'trajectory_controller = arm_servo.ros.trajectory_program:main',
            'servo_gamepad = arm_servo.teleop.servo_gamepad:main',
            'servo_keyboard_input = arm_servo.teleop.servo_keyboard_input:main',
        ],
    },
)
