# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_motion_bringup."""

from setuptools import find_packages, setup

setup(
    name='arm_motion_bringup',
    version='0.1.0',
    packages=find_packages(include=['arm_motion_bringup', 'arm_motion_bringup.*']),
    package_data={'arm_motion_bringup': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/arm_motion_bringup']),
        ('share/arm_motion_bringup', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='The demo of arm motion: jogging and trajectories of a simulated arm, measured',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'demo = arm_motion_bringup.demo.main:main',
        ],
    },
)
