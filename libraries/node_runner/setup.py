# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of node_runner."""

from pathlib import Path

from setuptools import find_packages, setup

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
    name='node_runner',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['node_runner', 'node_runner.*']),
    package_data={'node_runner': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/node_runner']),
        ('share/node_runner', ['package.xml']),
    ],
    install_requires=[
        sibling('libraries/black_box'),
        sibling('libraries/dds_network'),
        sibling('libraries/message_definitions'),
        sibling('libraries/realtime_loop'),
    ],
    extras_require={'test': ['pytest']},  # colcon test runs pytest where it is named
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Runs ROS nodes until they are to end, and reads their parameters',
    license='Apache-2.0',
)
