# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of operator_input."""

from setuptools import find_packages, setup

setup(
    name='operator_input',
    version='0.1.0',
    packages=find_packages(include=['operator_input', 'operator_input.*']),
    package_data={'operator_input': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/operator_input']),
        ('share/operator_input', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='What a person moves a robot with: keys and their releases, gamepads',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'show_keys = operator_input.show_keys:main',
            'show_gamepad = operator_input.show_gamepad:main',
        ],
    },
)
