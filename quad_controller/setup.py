# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_controller."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'attach_contract = quad_controller.attach_contract:main',
    'check_policy = quad_controller.policy_check.main:main',
    'controller_node = quad_controller.nodes.controller_node:main',
    'replay_policy = quad_controller.replay_policy:main',
]
COMMANDS = [
    'quad-attach-contract = quad_controller.attach_contract:main',
    'quad-check-policy = quad_controller.policy_check.main:main',
    'quad-replay-policy = quad_controller.replay_policy:main',
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
    name='quad_controller',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['quad_controller', 'quad_controller.*']),
    package_data={'quad_controller': ['py.typed', 'policies/*.onnx']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/quad_controller']),
        ('share/quad_controller', ['package.xml']),
    ],
    install_requires=[
        'numpy>=1.26',
        'onnxruntime>=1.19',
        'PyYAML>=6.0',
        sibling('quad_description'),
        sibling('libraries/rosbag_files'),
    ],
    extras_require={
        'test': ['pytest'],
        'ros': [sibling('libraries/message_templates'), sibling('libraries/node_runner')],
        'physics': [sibling('quad_hardware'), sibling('quad_sim')],
    },
    zip_safe=False,  # onnxruntime reads policies from their files
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Makes a quadruped walk: gait, ONNX policies, states and watchdogs',
    license='Apache-2.0',
    entry_points={
        'console_scripts': EXECUTABLES if FOR_ROS else COMMANDS,
    },
)
