# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Build description of process_supervisor."""

from pathlib import Path

from setuptools import find_packages, setup

CHECKOUT = Path(__file__).resolve().parents[2]


def sibling(folder: str) -> str:
    """Require a package of this checkout as it stands here, and never one of that name on PyPI.

    A wheel is for the machine that built it: it names the folder. An sdist has no neighbours.
    """
    path = CHECKOUT / folder
    if not path.is_dir():
        raise SystemExit(f'{path} is missing: install from a checkout of the whole repository')
    return f'{path.name} @ {path.as_uri()}'


setup(
    name='process_supervisor',
    version='0.1.0',
    python_requires='>=3.10',
    packages=find_packages(include=['process_supervisor', 'process_supervisor.*']),
    package_data={'process_supervisor': ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/process_supervisor']),
        ('share/process_supervisor', ['package.xml']),
    ],
    install_requires=['PyYAML>=6', 'rich>=13', sibling('libraries/dds_network')],
    extras_require={'test': ['pytest'], 'ros': [sibling('libraries/node_runner')]},
    zip_safe=True,
    maintainer='The arm and quad developers',
    maintainer_email='developers@example.org',
    description='Starts the processes of a robot, waits until they are ready, stops them in order',
    license='Apache-2.0',
)
