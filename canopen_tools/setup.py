# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of canopen_tools."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'candump = canopen_tools.candump:main',
    'canopen = canopen_tools.cli.main:main',
]
COMMANDS = [
    'canopen = canopen_tools.cli.main:main',
    'canopen-candump = canopen_tools.candump:main',
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
    name='canopen_tools',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['canopen_tools', 'canopen_tools.*']),
    package_data={'canopen_tools': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/canopen_tools']),
        ('share/canopen_tools', ['package.xml']),
    ],
    install_requires=[
        sibling('arm_canopen'),
        sibling('libraries/first_motion'),
    ],
    extras_require={
        'test': ['pytest'],  # colcon test runs pytest where it is named
        'first_motion': [sibling('libraries/operator_input')],  # whose evdev wants a compiler
    },
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='CANopen on the command line: check, scan, read, write, compare, candump in words',
    license='Apache-2.0',
    entry_points={
        'console_scripts': EXECUTABLES if FOR_ROS else COMMANDS,
    },
)
