# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_canopen."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'canopen_joint_state_publisher = arm_canopen.nodes.joint_state_publisher:main',
    'master = arm_canopen.nodes.master:main',
    'replay = arm_canopen.nodes.replay:main',
    # names of before that keep working; the programs are those of canopen_tools and _sim
    'candump = arm_canopen.aliases:candump',
    'canopen = arm_canopen.aliases:canopen',
    'fake_slave = arm_canopen.aliases:fake_slave',
    'fake_slaves = arm_canopen.aliases:fake_slaves',
]

CHECKOUT = Path(__file__).resolve().parents[1]


def sibling(folder: str) -> str:
    """Require a package of this checkout as it stands here, and never one of that name on PyPI.

    A wheel is for the machine that built it: it names the folder. An sdist has no neighbours.
    """
    path = CHECKOUT / folder
    if not path.is_dir():
        raise SystemExit(f'{path} is missing: install from a checkout of the whole repository')
    return f'{path.name} @ {path.as_uri()}'


setup(
    name='arm_canopen',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['arm_canopen', 'arm_canopen.*']),
    package_data={'arm_canopen': ['py.typed', 'config/resolve/default_drive.eds']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/arm_canopen']),
        ('share/arm_canopen', ['package.xml']),
        ('share/arm_canopen/eds', sorted(str(path) for path in Path('eds').iterdir())),
    ],
    install_requires=[
        'msgpack>=1.0.3',
        'python-can>=4.3',
        'PyYAML>=6',
        sibling('libraries/black_box'),
        sibling('libraries/realtime_loop'),
        sibling('libraries/urdf_reader'),
    ],
    extras_require={'test': ['pytest'], 'ros': [sibling('libraries/node_runner')]},
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='CANopen master and CiA 402 drives for ROS 2',
    license='Apache-2.0',
    entry_points={
        'can.interface': ['arm_canopen = arm_canopen.can.plugin:ArmCanopenBus'],
        'console_scripts': EXECUTABLES if FOR_ROS else [],
    },
)
