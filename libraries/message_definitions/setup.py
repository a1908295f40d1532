# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of message_definitions."""

from setuptools import find_packages, setup

setup(
    name='message_definitions',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['message_definitions', 'message_definitions.*']),
    package_data={'message_definitions': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/message_definitions']),
        ('share/message_definitions', ['package.xml']),
    ],
    extras_require={'test': ['pytest']},  # colcon test runs pytest where it is named
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Definitions of messages and services as recordings and viewers carry them',
    license='Apache-2.0',
)
