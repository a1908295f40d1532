# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_description."""

from pathlib import Path
import sys

from setuptools import find_packages, setup

# colcon runs one of these commands; pip asks for a wheel, and what needs `ros2 run` is not in it
FOR_ROS = not {'develop', 'install'}.isdisjoint(sys.argv)

EXECUTABLES = [
    'display = quad_description.display:main',
    'urdf = quad_description.urdf_command:main',
]
COMMANDS = [
    'quad-urdf = quad_description.urdf_command:main',
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


MODEL = Path('quad_description/model')


def model_files() -> list[str]:
    """Return the files of the model, as data_files wants them."""
    # a link whose target is missing must fail the build, not be passed over
    return sorted(str(path) for path in MODEL.iterdir() if not path.is_dir())


setup(
    name='quad_description',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['quad_description', 'quad_description.*']),
    package_data={'quad_description': ['py.typed', 'model/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/quad_description']),
        ('share/quad_description', ['package.xml']),
        # the same files again, where xacro and other robots' files look for them
        ('share/quad_description/model', model_files()),
    ],
    install_requires=['PyYAML>=6', 'xacro>=2'],
    extras_require={'test': ['pytest'], 'ros': [sibling('libraries/node_runner')]},
    zip_safe=False,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='The model of the XGO quadruped: URDF, legs, limits, poses, kinematics',
    license='Apache-2.0',
    entry_points={
        'console_scripts': EXECUTABLES if FOR_ROS else COMMANDS,
    },
)
