# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_teleop."""

from setuptools import find_packages, setup

setup(
    name='quad_teleop',
    version='0.1.0',
    packages=find_packages(include=['quad_teleop', 'quad_teleop.*']),
    package_data={'quad_teleop': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/quad_teleop']),
        ('share/quad_teleop', ['package.xml']),
        ('share/quad_teleop/config', ['config/twist_mux.yaml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Keyboard and gamepad for a walking robot, and a multiplexer of velocity commands',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'teleop_keyboard = quad_teleop.nodes.teleop_keyboard:main',
            'teleop_gamepad = quad_teleop.nodes.teleop_gamepad:main',
            'twist_mux = quad_teleop.nodes.twist_mux:main',
        ],
    },
)
