# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of first_motion."""

from setuptools import find_packages, setup

setup(
    name='first_motion',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['first_motion', 'first_motion.*']),
    package_data={'first_motion': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/first_motion']),
        ('share/first_motion', ['package.xml']),
    ],
    install_requires=['PyYAML>=6'],
    extras_require={'test': ['pytest']},  # colcon test runs pytest where it is named
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='The first motion of a joint: guarded, judged by what a person saw, corrected',
    license='Apache-2.0',
)
