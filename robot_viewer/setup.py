# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of robot_viewer."""

from setuptools import find_packages, setup

setup(
    name='robot_viewer',
    version='0.1.0',
    packages=find_packages(include=['robot_viewer', 'robot_viewer.*']),
    package_data={'robot_viewer': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/robot_viewer']),
        ('share/robot_viewer', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='What a viewer needs of a robot: robot_state_publisher',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'robot_state_publisher = robot_viewer.nodes.robot_state_publisher:main',
        ],
    },
)
