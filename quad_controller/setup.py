# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_controller."""

from pathlib import Path

from setuptools import find_packages, setup

POLICIES = sorted(str(path) for path in Path('policies').glob('*.onnx'))

setup(
    name='quad_controller',
    version='0.1.0',
    packages=find_packages(include=['quad_controller', 'quad_controller.*']),
    package_data={'quad_controller': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/quad_controller']),
        ('share/quad_controller', ['package.xml']),
        ('share/quad_controller/policies', POLICIES),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Makes a quadruped walk: gait, ONNX policies, states and watchdogs',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'check_policy = quad_controller.policy_check.main:main',
            'controller_node = quad_controller.nodes.controller_node:main',
        ],
    },
)
