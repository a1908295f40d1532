# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_bringup."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'bringup = quad_bringup.bringup:main',
    'demo = quad_bringup.examples.walk:main',
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
    name='quad_bringup',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['quad_bringup', 'quad_bringup.*']),
    package_data={'quad_bringup': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/quad_bringup']),
        ('share/quad_bringup', ['package.xml']),
        ('share/quad_bringup/launch', ['launch/bringup.launch.py']),
        (
            'share/quad_bringup/view',
            ['view/foxglove.json', 'view/plotjuggler.xml', 'view/quad.rviz'],
        ),
    ],
    install_requires=[
        'rich>=13',
        sibling('libraries/node_runner'),
        sibling('libraries/process_supervisor'),
        sibling('quad_controller'),
        sibling('quad_description'),
    ],
    extras_require={
        'test': ['pytest'],
        'ros': [
            sibling('quad_hardware'),
            sibling('quad_sim'),
            sibling('quad_teleop'),
            sibling('robot_viewer'),
        ],
    },
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='The quadruped brought up with one command, and the demo',
    license='Apache-2.0',
    entry_points={
        'console_scripts': EXECUTABLES if FOR_ROS else [],
    },
)
