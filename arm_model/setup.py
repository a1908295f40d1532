# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_model."""

from setuptools import find_packages, setup

setup(
    name='arm_model',
    version='0.1.0',
    packages=find_packages(include=['arm_model', 'arm_model.*']),
    package_data={'arm_model': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/arm_model']),
        ('share/arm_model', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Robot arms as values: description, limits, kinematics, distances',
    license='Apache-2.0',
)
