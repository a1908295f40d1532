# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Python packages that the set-up installs by itself."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
import runpy
import subprocess
import sys
from typing import Any

from fake_programs import FakeRunner, imitate_package
import pytest

from workspace.build import Builder
from workspace.cli import carry_out, plan, Target
from workspace.environment import Environment
from workspace.layout import Layout, this_checkout, WorkspaceError
from workspace.link import link_package, PYTHON, read_setup
from workspace.packages import find_packages, read_package

Add = Callable[..., Path]
Fake = Callable[..., FakeRunner]
PACKAGES = [
    package
    for package in find_packages(this_checkout().root).values()
    if package.build_type == 'ament_python'
]


def built(environment: Environment, fake: Fake) -> Path:
    """Bring everything up to date; return the installation."""
    carry_out(plan(environment, Target()), fake())
    return environment.layout.install


@pytest.mark.parametrize('package', PACKAGES, ids=lambda package: package.name)
def test_setup_py_is_read_as_setuptools_reads_it(
    package: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same modules at the top, the same data, the same programs."""
    theirs: dict[str, Any] = {}
    monkeypatch.setattr('setuptools.setup', theirs.update)
    monkeypatch.chdir(package.folder)
    monkeypatch.setattr(sys, 'argv', ['setup.py', 'develop'])
    runpy.run_path('setup.py')
    ours = read_setup(package.folder)
    assert ours['packages'] == sorted({name.partition('.')[0] for name in theirs['packages']})
    ours['packages'] = theirs['packages']
    assert ours == theirs


def test_a_program_runs_the_function_that_it_names(add_package: Add, tmp_path: Path) -> None:
    """Its exit code is what that returns; importing it, as multiprocessing does, runs nothing."""
    folder = add_package('arm')
    (folder / 'arm' / '__init__.py').write_text('import sys\nmain = lambda: len(sys.argv) + 5\n')
    install = tmp_path / 'install'
    link_package(read_package(folder / 'package.xml'), install, Path(sys.executable))
    program = install / 'lib' / 'arm' / 'run'
    environ = {'PYTHONPATH': str(install / PYTHON)}
    assert subprocess.run([program, 'x'], env=environ, check=False).returncode == 7
    runpy.run_path(str(program), run_name='__mp_main__')
    code = 'import importlib.metadata as m; print(m.version("arm"), *m.entry_points(name="run"))'
    done = subprocess.run(
        [sys.executable, '-c', code], env=environ, check=True, capture_output=True, text=True
    )
    assert done.stdout.startswith("1.2 EntryPoint(name='run', value='arm:main'")


def test_programs_stay_below_the_name_that_setup_cfg_says(
    add_package: Add, tmp_path: Path
) -> None:
    """`ros2 run` finds them by a former name of their package."""
    folder = add_package('arm')
    (folder / 'setup.cfg').write_text('[install]\ninstall_scripts=$base/lib/old_arm\n')
    link_package(read_package(folder / 'package.xml'), tmp_path, Path(sys.executable))
    assert [path.name for path in (tmp_path / 'lib').glob('*/run')] == ['run']
    assert (tmp_path / 'lib' / 'old_arm' / 'run').is_file()


def test_a_renamed_program_leaves_nothing_behind(
    environment: Environment, layout: Layout, add_package: Add, fake: Fake
) -> None:
    """setup.py is part of what decides whether a package is built."""
    setup = add_package('arm') / 'setup.py'
    install = built(environment, fake)
    setup.write_text(setup.read_text().replace('run =', 'go ='))
    built(environment, fake)
    assert [path.name for path in (install / 'lib' / 'arm').iterdir()] == ['go']
    assert (install / PYTHON / 'arm').resolve() == layout.root / 'arm' / 'arm'


def test_a_file_that_is_not_there_is_named(add_package: Add, tmp_path: Path) -> None:
    """A data file that setup.py promises; nothing is installed then."""
    folder = add_package('arm')
    (folder / 'resource' / 'arm').unlink()
    with pytest.raises(WorkspaceError, match=r'resource/arm is not there'):
        link_package(read_package(folder / 'package.xml'), tmp_path, Path(sys.executable))
    assert not (tmp_path / PYTHON).exists()


def test_a_setup_py_that_fails_is_named(add_package: Add) -> None:
    """With the reason, and the working directory stays."""
    folder, before = add_package('arm'), Path.cwd()
    (folder / 'setup.py').write_text('raise SystemExit("no neighbours")\n')
    with pytest.raises(WorkspaceError, match=r'arm/setup\.py: SystemExit: no neighbours'):
        read_setup(folder)
    assert Path.cwd() == before


def test_what_colcon_installed_is_replaced(
    environment: Environment, layout: Layout, add_package: Add, fake: Fake
) -> None:
    """It puts each package into a prefix of its own, and so did older versions of this set-up."""
    add_package('arm')
    built(environment, fake)
    builder = Builder(layout, environment.base, environment.underlay.kind, 1)
    hashes = builder.fingerprints(find_packages(layout.root))
    assert builder.stale(hashes) == []
    (layout.install / '.colcon_install_layout').write_text('isolated\n')
    imitate_package(layout.install / 'gone', 'gone')
    assert builder.stale(hashes) == ['arm']
    install = built(environment, fake)
    assert not (install / 'gone').exists()
    assert (install / 'lib' / 'arm' / 'run').is_file()


def test_a_package_of_cmake_is_left_to_colcon(
    environment: Environment, add_package: Add, fake: Fake
) -> None:
    """One that has no messages, as descriptions of robots often are; into the same prefix."""
    folder = add_package('robot_meshes', build_type='ament_cmake')
    manifest = folder / 'package.xml'
    group = '<member_of_group>rosidl_interface_packages</member_of_group>'
    manifest.write_text(manifest.read_text().replace(group, ''))
    seen: list[list[str]] = []
    carry_out(plan(environment, Target(build=False)), fake())
    with pytest.raises(WorkspaceError, match='robot_meshes'):  # nothing builds it here
        carry_out(plan(environment, Target()), replace(fake(), effect=seen.append))
    (command,) = seen
    assert command[command.index('--packages-select') + 1] == 'robot_meshes'
    assert '--merge-install' in command
