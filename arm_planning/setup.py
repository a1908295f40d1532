# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_planning."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'move_group = arm_planning.nodes.move_group:main',
    'srdf = arm_planning.aliases:srdf',  # a program of arm_bringup
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
    name='arm_planning',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['arm_planning', 'arm_planning.*']),
    package_data={'arm_planning': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/arm_planning']),
        ('share/arm_planning', ['package.xml']),
    ],
    install_requires=[
        'numpy>=1.26',
        'pin>=3.3',
        'PyYAML>=6',
        sibling('arm_model'),
        sibling('arm_trajectory'),
        sibling('libraries/urdf_reader'),
    ],
    extras_require={'test': ['pytest'], 'ros': [sibling('libraries/node_runner')]},
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Motion planning of an arm among obstacles',
    license='Apache-2.0',
    entry_points={'console_scripts': EXECUTABLES if FOR_ROS else []},
)
