# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of canopen_tools."""

from setuptools import find_packages, setup

setup(
    name='canopen_tools',
    version='0.1.0',
    packages=find_packages(include=['canopen_tools', 'canopen_tools.*']),
    package_data={'canopen_tools': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/canopen_tools']),
        ('share/canopen_tools', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='CANopen on the command line: check, scan, read, write, compare, candump in words',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'candump = canopen_tools.candump:main',
            'canopen = canopen_tools.cli.main:main',
        ],
    },
)
