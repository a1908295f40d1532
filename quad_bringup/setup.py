# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_bringup."""

from setuptools import find_packages, setup

setup(
    name='quad_bringup',
    version='0.1.0',
    packages=find_packages(include=['quad_bringup', 'quad_bringup.*']),
    package_data={'quad_bringup': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/quad_bringup']),
        ('share/quad_bringup', ['package.xml']),
        ('share/quad_bringup/launch', ['launch/bringup.launch.py']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='The quadruped brought up with one command, and the demo',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'bringup = quad_bringup.bringup:main',
            'demo = quad_bringup.demo.main:main',
        ],
    },
)
