# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of operator_input."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'show_keys = operator_input.show_input:show_keys',
    'show_gamepad = operator_input.show_input:show_gamepad',
]
COMMANDS = [
    'operator-show-gamepad = operator_input.show_input:show_gamepad',
    'operator-show-keys = operator_input.show_input:show_keys',
]

CHECKOUT = Path(__file__).resolve().parents[2]


def sibling(folder: str) -> str:
    """Require a package of this checkout as it stands here, and never one of that name on PyPI.

    A wheel is for the machine that built it: it names the folder. An sdist has no neighbours.
    """
    path = CHECKOUT / folder
    if not path.is_dir():
        raise SystemExit(f'{path} is missing: install from a checkout of the whole repository')
    return f'{path.name} @ {path.as_uri()}'


setup(
    name='operator_input',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['operator_input', 'operator_input.*']),
    package_data={'operator_input': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/operator_input']),
        ('share/operator_input', ['package.xml']),
    ],
    install_requires=['evdev>=1.6; sys_platform == "linux"'],
    extras_require={'test': ['pytest'], 'ros': [sibling('libraries/node_runner')]},
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='What a person moves a robot with: keys and their releases, gamepads',
    license='Apache-2.0',
    entry_points={
        'console_scripts': EXECUTABLES if FOR_ROS else COMMANDS,
    },
)
