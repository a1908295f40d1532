# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_hardware."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'calibrate = quad_hardware.calibration.main:main',
    'doctor = quad_hardware.doctor.main:main',
    'hardware_node = quad_hardware.nodes.hardware_node:main',
    'protocol = quad_hardware.protocol.page:main',
    'replay = quad_hardware.nodes.replay:main',
]
COMMANDS = [
    'xgo-calibrate = quad_hardware.calibration.main:main',
    'xgo-doctor = quad_hardware.doctor.main:main',
    'xgo-protocol = quad_hardware.protocol.page:main',
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
    name='quad_hardware',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['quad_hardware', 'quad_hardware.*', 'xgo_lib2']),
    package_data={'quad_hardware': ['py.typed'], 'xgo_lib2': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/quad_hardware']),
        ('share/quad_hardware', ['package.xml']),
    ],
    install_requires=[
        'pyserial>=3.5',
        'PyYAML>=6',
        sibling('libraries/black_box'),
        sibling('libraries/dds_network'),
        sibling('quad_description'),
    ],
    extras_require={
        'test': ['pytest'],
        'ros': [sibling('libraries/message_templates'), sibling('libraries/node_runner')],
    },
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Serial bridge of the XGO quadruped: both protocols, driver, node and tools',
    license='Apache-2.0',
    entry_points={
        'console_scripts': EXECUTABLES if FOR_ROS else COMMANDS,
    },
)
