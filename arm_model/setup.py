# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_model."""

from pathlib import Path

from setuptools import find_packages, setup

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
    name='arm_model',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['arm_model', 'arm_model.*']),
    package_data={'arm_model': ['py.typed', 'panda/*']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/arm_model']),
        ('share/arm_model', ['package.xml']),
    ],
    install_requires=[
        'coal>=3',
        'numpy>=1.26',
        'pin>=3.3',
        'PyYAML>=6',
        sibling('libraries/urdf_reader'),
    ],
    extras_require={'test': ['pytest'], 'ros': [sibling('libraries/node_runner')]},
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Robot arms as values: description, limits, kinematics, distances',
    license='Apache-2.0',
)
