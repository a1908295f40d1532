# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of rosbag_files."""

from setuptools import find_packages, setup

setup(
    name='rosbag_files',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['rosbag_files', 'rosbag_files.*']),
    package_data={'rosbag_files': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/rosbag_files']),
        ('share/rosbag_files', ['package.xml']),
    ],
    install_requires=['mcap>=1.6', 'PyYAML>=5.4', 'zstandard>=0.21'],
    extras_require={'test': ['pytest']},  # colcon test runs pytest where it is named
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Reads and writes rosbag2 directories',
    license='Apache-2.0',
)
