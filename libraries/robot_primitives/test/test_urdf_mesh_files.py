# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names of mesh files."""

from __future__ import annotations

from pathlib import Path

import pytest
from urdf_reader import find_mesh


def test_meshes_are_found_as_ros_finds_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By package, installed or as a source, beside the description, as a file, by its path."""
    folder = tmp_path / 'robots' / 'my_arm' / 'urdf'
    folder.mkdir(parents=True)
    for place in ('prefix/share/installed', 'src/source', 'robots/beside', 'robots/my_arm'):
        (tmp_path / place / 'meshes').mkdir(parents=True)
        (tmp_path / place / 'meshes' / 'a b.stl').write_text('', encoding='utf-8')
        (tmp_path / place / 'package.xml').write_text('', encoding='utf-8')
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path / 'prefix'))
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(tmp_path / 'src'))
    wanted = {
        'package://installed/meshes/a%20b.stl': 'prefix/share/installed',
        'package://source/meshes/a b.stl': 'src/source',
        'package://beside/meshes/a b.stl': 'robots/beside',
        'package://my_arm/meshes/a b.stl': 'robots/my_arm',
        '../meshes/a b.stl': 'robots/my_arm',
        f'file://{tmp_path}/src/source/meshes/a%20b.stl': 'src/source',
        f'{tmp_path}/src/source/meshes/a b.stl': 'src/source',
    }
    for name, place in wanted.items():
        found = find_mesh(name, folder)
        assert found.resolve() == (tmp_path / place / 'meshes' / 'a b.stl').resolve()
