# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_canopen."""

from pathlib import Path

from setuptools import find_packages, setup

setup(
    name='arm_canopen',
    version='0.1.0',
    packages=find_packages(include=['arm_canopen', 'arm_canopen.*']),
    package_data={'arm_canopen': ['py.typed', 'config/default_drive.eds']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/arm_canopen']),
        ('share/arm_canopen', ['package.xml']),
        ('share/arm_canopen/eds', sorted(str(path) for path in Path('eds').iterdir())),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='CANopen master and CiA 402 drives for ROS 2',
    license='Apache-2.0',
    entry_points={
        'can.interface': ['arm_canopen = arm_canopen.can.plugin:ArmCanopenBus'],
        'console_scripts': [
            'canopen_joint_state_publisher = arm_canopen.nodes.joint_state_publisher:main',
            'master = arm_canopen.nodes.master:main',
            # names of before that keep working; the programs are those of canopen_tools and _sim
            'candump = arm_canopen.aliases:candump',
            'canopen = arm_canopen.aliases:canopen',
            'fake_slave = arm_canopen.aliases:fake_slave',
            'fake_slaves = arm_canopen.aliases:fake_slaves',
        ],
    },
)
