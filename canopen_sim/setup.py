# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of canopen_sim."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'fake_slave = canopen_sim.nodes.fake_slave:main',
    'fake_slaves = canopen_sim.nodes.fake_slaves:main',
]
COMMANDS = ['canopen-fake-slaves = canopen_sim.fake_slaves_command:main']

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
    name='canopen_sim',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['canopen_sim', 'canopen_sim.*']),
    package_data={'canopen_sim': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/canopen_sim']),
        ('share/canopen_sim', ['package.xml']),
        (
            'share/canopen_sim/scenarios',
            sorted(str(path) for path in Path('scenarios').iterdir()),
        ),
    ],
    install_requires=[sibling('arm_canopen')],
    extras_require={'test': ['pytest'], 'ros': [sibling('libraries/node_runner')]},
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Simulated CANopen devices and CiA 402 drives, with faults',
    license='Apache-2.0',
    entry_points={
        'console_scripts': EXECUTABLES if FOR_ROS else COMMANDS,
    },
)
