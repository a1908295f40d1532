# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_description."""

from pathlib import Path

from setuptools import find_packages, setup

MODEL = Path('quad_description/model')


def model_files() -> list[str]:
    """Return the files of the model, as data_files wants them."""
    # a link whose target is missing must fail the build, not be passed over
    return sorted(str(path) for path in MODEL.iterdir() if not path.is_dir())


setup(
    name='quad_description',
    version='0.1.0',
    packages=find_packages(include=['quad_description', 'quad_description.*']),
    package_data={'quad_description': ['py.typed', 'model/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/quad_description']),
        ('share/quad_description', ['package.xml']),
        # the same files again, where xacro and other robots' files look for them
        ('share/quad_description/model', model_files()),
    ],
    install_requires=['setuptools'],
    zip_safe=False,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='The model of the XGO quadruped: URDF, legs, limits, poses, kinematics',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'display = quad_description.display:main',
            'urdf = quad_description.urdf_command:main',
        ],
    },
)
