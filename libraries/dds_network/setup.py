# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of dds_network."""

from setuptools import find_packages, setup

setup(
    name='dds_network',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['dds_network', 'dds_network.*']),
    package_data={'dds_network': ['py.typed', '*.xml']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/dds_network']),
        ('share/dds_network', ['package.xml']),
    ],
    extras_require={'test': ['pytest']},  # colcon test runs pytest where it is named
    zip_safe=False,  # Fast DDS reads the profile from its file
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Keeps DDS on this host unless a person opens it',
    license='Apache-2.0',
)
