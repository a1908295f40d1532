# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_bringup."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'bringup = arm_bringup.bringup:main',
    'check = arm_bringup.check:main',
    'demo = arm_bringup.examples.wave:main',
    'motion_demo = arm_bringup.examples:motion_demo',
    'plan_demo = arm_bringup.examples:plan_demo',
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


# installed as they are; a robot folder is found by its name in share/arm_bringup/robots
FOLDERS = [Path('macros'), *sorted(Path('robots').iterdir())]


def files(folder: Path) -> list[str]:
    """Return the files of a folder, as data_files wants them."""
    # a link whose target is missing must fail the build, not be passed over
    return sorted(str(path) for path in folder.iterdir() if not path.is_dir())


setup(
    name='arm_bringup',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['arm_bringup', 'arm_bringup.*']),
    package_data={'arm_bringup': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/arm_bringup']),
        ('share/arm_bringup', ['package.xml']),
        *((f'share/arm_bringup/{folder}', files(folder)) for folder in FOLDERS),
    ],
    install_requires=[
        'PyYAML>=6',
        'rich>=13',
        sibling('arm_canopen'),
        sibling('libraries/process_supervisor'),
        sibling('libraries/urdf_reader'),
    ],
    extras_require={
        'test': ['pytest'],
        'motion': [
            'numpy>=1.26',
            sibling('arm_model'),
            sibling('arm_planning'),
            sibling('arm_servo'),
            sibling('arm_trajectory'),
        ],
        'ros': [
            sibling('canopen_sim'),
            sibling('libraries/node_runner'),
            sibling('robot_viewer'),
        ],
    },
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Robots on CANopen buses, their bring-up with one command, and the demo',
    license='Apache-2.0',
    entry_points={
        'console_scripts': EXECUTABLES if FOR_ROS else [],
    },
)
