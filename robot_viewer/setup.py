# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of robot_viewer."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'foxglove_bridge = robot_viewer.nodes.foxglove_bridge:main',
    'robot_state_publisher = robot_viewer.nodes.robot_state_publisher:main',
    'web_viewer = robot_viewer.nodes.web_viewer:main',
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
    name='robot_viewer',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['robot_viewer', 'robot_viewer.*']),
    package_data={'robot_viewer': ['py.typed', 'page/overlay.html']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/robot_viewer']),
        ('share/robot_viewer', ['package.xml']),
    ],
    install_requires=[sibling('libraries/urdf_reader')],
    extras_require={
        'test': ['pytest'],
        'page': [
            'numpy',
            'trimesh',
            'viser',
            'websockets',
            sibling('libraries/first_motion'),
        ],
        'foxglove': ['foxglove-sdk>=0.30'],
        'ros': [sibling('libraries/message_definitions'), sibling('libraries/node_runner')],
    },
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='A robot in the browser, and robot_state_publisher',
    license='Apache-2.0',
    entry_points={
        'console_scripts': EXECUTABLES if FOR_ROS else [],
    },
)
