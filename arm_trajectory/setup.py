# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_trajectory."""

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
    name='arm_trajectory',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['arm_trajectory', 'arm_trajectory.*']),
    package_data={'arm_trajectory': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/arm_trajectory']),
        ('share/arm_trajectory', ['package.xml']),
    ],
    install_requires=['numpy>=1.26', 'ruckig>=0.19', sibling('arm_model')],
    extras_require={'test': ['pytest']},  # colcon test runs pytest where it is named
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Jerk-limited trajectories of an arm, planned and checked before anything moves',
    license='Apache-2.0',
)
