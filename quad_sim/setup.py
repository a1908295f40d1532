# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_sim."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'export_mjcf = quad_sim.export_mjcf:main',
    'fake_xgo = quad_sim.fake_xgo:main',
]
COMMANDS = [
    'fake_xgo = quad_sim.fake_xgo:main',
    'quad-export-mjcf = quad_sim.export_mjcf:main',
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
    name='quad_sim',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['quad_sim', 'quad_sim.*']),
    package_data={'quad_sim': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/quad_sim']),
        ('share/quad_sim', ['package.xml']),
    ],
    install_requires=[
        "mujoco-core; python_version >= '3.11'",
        "mujoco<4; python_version < '3.11'",
        'numpy>=1.26',
        sibling('libraries/process_supervisor'),
        sibling('quad_description'),
        sibling('quad_hardware'),
    ],
    extras_require={
        'test': ['pytest'],
        'ros': [sibling('libraries/node_runner')],
        'env': ['gymnasium>=1.1'],
    },
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='The XGO quadruped in physics, behind a board that speaks its serial protocols',
    license='Apache-2.0',
    entry_points={'console_scripts': EXECUTABLES if FOR_ROS else COMMANDS},
)
