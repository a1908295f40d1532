# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Interface packages that the set-up builds by itself."""

import json
import os
from pathlib import Path
import re
import subprocess
import sys
from typing import Any

import pytest

from workspace import interfaces
from workspace.layout import this_checkout
from workspace.packages import find_packages

PACKAGES = [each for each in find_packages(this_checkout().root).values() if each.is_interface]


@pytest.mark.parametrize('package', PACKAGES, ids=lambda package: package.name)
def test_cmake_builds_the_same_interfaces(package: Any) -> None:
    """On wheels all files of the three folders count, with a system's ROS what is listed."""
    listed = re.findall(r'"(\S+\.\w+)"', (package.folder / 'CMakeLists.txt').read_text())
    there = [path for kind in interfaces.KINDS for path in package.folder.glob(f'{kind}/*')]
    assert sorted(listed) == sorted(str(path.relative_to(package.folder)) for path in there)


def build(folder: Path, needs: dict[str, list[str]], **texts: str) -> tuple[int, str]:
    """Build packages of one message each; return the exit code and what was printed."""
    for name, text in texts.items():
        (folder / name / 'msg').mkdir(parents=True)
        (folder / name / 'msg' / 'Item.msg').write_text(text)
        (folder / name / 'package.xml').write_text('<package/>')
    (folder / 'install' / 'share').mkdir(parents=True)
    packages = {
        name: {'folder': str(folder / name), 'needs': needs.get(name, [])} for name in texts
    }
    places = {'build': str(folder / 'build'), 'install': str(folder / 'install')}
    request = {**places, 'jobs': 2, 'workers': 2, 'packages': packages}
    done = subprocess.run(
        [sys.executable, interfaces.__file__, json.dumps(request)],
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr


@pytest.mark.slow
def test_one_failed_package_does_not_cost_the_others(tmp_path: Path) -> None:
    """It is named with the reason, what stands on it is not tried, and the rest works."""
    if not (Path(sys.prefix) / 'share' / 'rosidl_generator_c').is_dir():
        pytest.skip('ROS does not come from wheels here')
    code, output = build(
        tmp_path,
        {'upper': ['lower'], 'above': ['broken']},
        broken='float23 x\n',
        lower='uint8 MORE=7\nint32[] numbers\n',
        above='int32 x\n',
        upper='lower/Item item\nstd_msgs/Header header\n',
    )
    assert code == 1
    assert 'broken: ' in output
    assert 'Failed   <<< broken' in output
    assert 'above' not in output
    install = tmp_path / 'install'
    made = sorted(path.parent.name for path in install.glob('share/*/package.xml'))
    assert made == ['lower', 'upper']
    program = f"""
import sys
sys.path.insert(0, {str(install / 'lib' / 'python')!r})
from rclpy.serialization import deserialize_message, serialize_message
from upper.msg import Item
from lower.msg import Item as Lower
item = Item(item=Lower(numbers=[1, Lower.MORE]))
item.header.frame_id = 'base'
print(deserialize_message(serialize_message(item), Item) == item)
"""
    path = f'{install}/lib:{os.environ.get("LD_LIBRARY_PATH", "")}'
    done = subprocess.run(
        [sys.executable, '-c', program],
        env={**os.environ, 'LD_LIBRARY_PATH': path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == 'True\n', done.stderr


def test_packages_that_need_each_other_are_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing waits for them."""
    monkeypatch.setattr(interfaces, 'load_generators', lambda: None)
    workshops: Any = {'one': None, 'two': None}
    needs = {'one': ['two'], 'two': ['one']}
    assert interfaces.build_all(workshops, needs, jobs=1, workers=1) == ['one', 'two']
    assert 'These need each other: one, two' in capsys.readouterr().err
