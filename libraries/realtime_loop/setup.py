# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of realtime_loop."""

from setuptools import find_packages, setup

setup(
    name='realtime_loop',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['realtime_loop', 'realtime_loop.*']),
    package_data={'realtime_loop': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/realtime_loop']),
        ('share/realtime_loop', ['package.xml']),
    ],
    extras_require={'test': ['pytest']},  # colcon test runs pytest where it is named
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='What every thread that owns a cycle needs: deadlines, priority, memory',
    license='Apache-2.0',
)
