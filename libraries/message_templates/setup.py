# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of message_templates."""

from setuptools import find_packages, setup

setup(
    name='message_templates',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['message_templates', 'message_templates.*']),
    package_data={'message_templates': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/message_templates']),
        ('share/message_templates', ['package.xml']),
    ],
    extras_require={'test': ['pytest']},  # colcon test runs pytest where it is named
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Messages that come often, as bytes in which only the numbers change',
    license='Apache-2.0',
)
