# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of black_box."""

from setuptools import find_packages, setup

setup(
    name='black_box',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['black_box', 'black_box.*']),
    package_data={'black_box': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/black_box']),
        ('share/black_box', ['package.xml']),
    ],
    extras_require={'test': ['pytest']},  # colcon test runs pytest where it is named
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='What happened before a fault: kept in memory, written when it comes',
    license='Apache-2.0',
)
