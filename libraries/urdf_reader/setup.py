# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of urdf_reader."""

from setuptools import find_packages, setup

setup(
    name='urdf_reader',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['urdf_reader', 'urdf_reader.*']),
    package_data={'urdf_reader': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/urdf_reader']),
        ('share/urdf_reader', ['package.xml']),
    ],
    install_requires=['xacro>=2'],
    extras_require={'test': ['pytest']},  # colcon test runs pytest where it is named
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Reads URDF and SRDF',
    license='Apache-2.0',
)
