# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of quad_hardware."""

from setuptools import find_packages, setup

setup(
    name='quad_hardware',
    version='0.1.0',
    packages=find_packages(include=['quad_hardware', 'quad_hardware.*', 'xgo_lib2']),
    package_data={'quad_hardware': ['py.typed'], 'xgo_lib2': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/quad_hardware']),
        ('share/quad_hardware', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Serial bridge of the XGO quadruped: both protocols, driver, node and tools',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            # the simulated robot's, under the name that it is printed by; quad_sim has it
            'fake_xgo = quad_hardware.aliases:fake_xgo',
            'calibrate = quad_hardware.calibration.main:main',
            'doctor = quad_hardware.doctor.main:main',
            'hardware_node = quad_hardware.nodes.hardware_node:main',
            'protocol = quad_hardware.protocol.page:main',
        ],
    },
)
