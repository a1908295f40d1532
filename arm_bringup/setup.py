# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of arm_bringup."""

from pathlib import Path

from setuptools import find_packages, setup

# installed as they are; a robot folder is found by its name in share/arm_bringup/robots
FOLDERS = [Path('macros'), *sorted(Path('robots').iterdir())]


def files(folder: Path) -> list[str]:
    """Return the files of a folder, as data_files wants them."""
    # a link whose target is missing must fail the build, not be passed over
    return sorted(str(path) for path in folder.iterdir() if not path.is_dir())


setup(
    name='arm_bringup',
    version='0.1.0',
    packages=find_packages(include=['arm_bringup', 'arm_bringup.*']),
    package_data={'arm_bringup': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/arm_bringup']),
        ('share/arm_bringup', ['package.xml']),
        *((f'share/arm_bringup/{folder}', files(folder)) for folder in FOLDERS),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Robots on CANopen buses, their bring-up with one command, and the demo',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'bringup = arm_bringup.bringup:main',
            'check = arm_bringup.check:main',
            'demo = arm_bringup.demos.wave.main:main',
            'motion_demo = arm_bringup.demos.motion:main',
            'wave_master = arm_bringup.demos.wave.master:main',
        ],
    },
)
