# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From any state that a run can leave behind, the next run leads to the whole."""

from collections.abc import Callable
from dataclasses import replace
import os
from pathlib import Path
import shutil
import sys
from typing import Any

from fake_programs import FakeRunner
import pytest

from workspace.build import Builder
from workspace.cli import carry_out, plan, Target
from workspace.environment import choose_python, DOCS, Environment, uv_settings
from workspace.layout import (
    EnvironmentState,
    Layout,
    NetworkError,
    read_state,
    StepFailedError,
    WorkspaceError,
)
from workspace.process import Runner
from workspace.system import probe
from workspace.underlay import Underlay, UnderlayKind

pytestmark = pytest.mark.slow

Add = Callable[..., Path]
Fake = Callable[..., FakeRunner]
ALL = Target(dev=True)


@pytest.fixture
def packages(add_package: Add) -> None:
    """An arm on its interfaces, and a quadruped on its own."""
    add_package('arm_msgs', build_type='ament_cmake')
    add_package('arm', 'arm_msgs')
    add_package('quad_msgs', 'arm_msgs', build_type='ament_cmake')


def titles(environment: Environment, target: Target = ALL) -> list[str]:
    """What would be done, in words."""
    return [step.title for step in plan(environment, target)]


@pytest.mark.usefixtures('packages')
@pytest.mark.parametrize('fail_at', range(1, 8))
def test_interruption_anywhere_is_repaired(
    environment: Environment, fake: Fake, fail_at: int
) -> None:
    """Wherever a run ends, the next one starts again with what is not finished."""
    broken = fake(fail_at)
    try:
        carry_out(plan(environment, ALL), broken)
    except KeyboardInterrupt:
        assert titles(environment) != []
    else:
        assert len(broken.seen) < fail_at
    carry_out(plan(environment, ALL), fake())
    assert titles(environment) == []


@pytest.mark.usefixtures('packages')
def test_interrupted_change_makes_the_environment_new(
    environment: Environment, fake: Fake
) -> None:
    """Half-installed test tools may have left anything, so nothing of it is kept."""
    carry_out(plan(environment, Target()), fake())
    with pytest.raises(KeyboardInterrupt):
        carry_out(plan(environment, ALL), fake(1))
    assert read_state(environment.layout.state) is None
    assert titles(environment, Target(build=False))[1].startswith('Making .venv')


@pytest.mark.usefixtures('packages')
def test_a_target_builds_only_what_it_needs(environment: Environment, fake: Fake) -> None:
    """The demo does not wait for the quadruped's messages, nor for the test tools."""
    target = Target(packages=('arm',))
    assert titles(environment, target)[-1] == 'Building arm_msgs, arm'
    carry_out(plan(environment, target), fake())
    assert titles(environment, ALL)[-1] == 'Building quad_msgs'


@pytest.mark.usefixtures('packages')
def test_changed_interface_rebuilds_what_stands_on_it(
    environment: Environment, layout: Layout, fake: Fake
) -> None:
    """Interfaces on interfaces are compiled again, Python on interfaces is not."""
    carry_out(plan(environment, ALL), fake())
    (layout.root / 'arm_msgs' / 'New.msg').touch()
    assert titles(environment) == ['Building arm_msgs, quad_msgs']


@pytest.mark.usefixtures('packages')
@pytest.mark.parametrize('lost', ['build/arm_msgs', 'install/share/arm_msgs'])
def test_what_was_deleted_is_built_again(
    environment: Environment, layout: Layout, fake: Fake, lost: str
) -> None:
    """With symbolic links both folders are needed."""
    carry_out(plan(environment, ALL), fake())
    shutil.rmtree(layout.root / lost)
    assert titles(environment) == ['Building arm_msgs']


@pytest.mark.usefixtures('packages')
def test_removed_package_is_removed(environment: Environment, layout: Layout, fake: Fake) -> None:
    """A package that left the workspace does not linger among the installed."""
    carry_out(plan(environment, ALL), fake())
    shutil.rmtree(layout.root / 'arm')
    carry_out(plan(environment, ALL), fake())
    assert not [path for path in layout.install.rglob('*') if path.name.startswith('arm.')]
    assert not [path for path in layout.install.rglob('*') if path.name == 'arm']
    assert titles(environment) == []


@pytest.mark.usefixtures('packages')
def test_other_ros_replaces_environment_and_packages(
    environment: Environment, layout: Layout, fake: Fake, tmp_path: Path
) -> None:
    """When /opt/ros/jazzy appears, nothing that was built on wheels stays."""
    carry_out(plan(environment, ALL), fake())
    system = replace(environment, underlay=Underlay(UnderlayKind.SYSTEM, tmp_path / 'ros'))
    runner = fake()
    carry_out(plan(system, Target(packages=('arm',))), runner)
    assert not [*layout.install.rglob('quad_msgs')]
    assert titles(system, Target(packages=('arm',))) == []


@pytest.mark.parametrize('name', ['uv.txt', 'ros-wheels.txt', 'dev.txt'])
def test_new_pins_are_installed(
    environment: Environment, layout: Layout, fake: Fake, name: str
) -> None:
    """A changed requirement leads to work, and of dev.txt only to its own."""
    target = Target(dev=True, build=False)
    carry_out(plan(environment, target), fake())
    (layout.requirements / name).write_text('new==2\n')
    assert len(titles(environment, target)) == (1 if name == 'dev.txt' else 5)


@pytest.mark.usefixtures('packages')
def test_a_package_brings_what_it_imports(
    environment: Environment, layout: Layout, fake: Fake
) -> None:
    """Its requirements are installed when it, or what stands on it, is first built."""
    (layout.requirements / 'arm_msgs.txt').write_text('heavy==1\n')
    assert 'Installing what arm_msgs imports' in titles(environment, Target(packages=('arm',)))
    carry_out(plan(environment, ALL), fake())
    assert titles(environment) == titles(environment, Target(packages=('arm',))) == []
    (layout.requirements / 'arm.txt').write_text('light==1\n')
    assert titles(environment) == ['Installing what arm imports']
    assert titles(environment, Target(packages=('arm_msgs',))) == []


@pytest.mark.parametrize('change', ['pins', 'test tools'])
def test_missing_network_costs_no_environment(
    environment: Environment, layout: Layout, fake: Fake, change: str
) -> None:
    """New pins, or test tools, that cannot be downloaded leave the environment as it was."""
    target = Target(build=False)
    carry_out(plan(environment, target), fake())
    before = read_state(layout.state)

    def unreachable(_arguments: list[str]) -> None:
        raise NetworkError('it')

    if change == 'pins':
        (layout.requirements / 'ros-wheels.txt').write_text('new==2\n')
    wanted = replace(target, dev=change == 'test tools')
    with pytest.raises(NetworkError):
        carry_out(plan(environment, wanted), replace(fake(), effect=unreachable))
    assert read_state(layout.state) == before is not None


def test_old_tools_that_fail_do_not_keep_the_old_environment(
    environment: Environment, layout: Layout, fake: Fake
) -> None:
    """An environment whose own pip or uv is damaged is replaced."""
    target = Target(build=False)
    carry_out(plan(environment, target), fake())
    (layout.requirements / 'ros-wheels.txt').write_text('new==2\n')
    runner = fake()

    def damaged(arguments: list[str]) -> None:
        if 'download' in arguments:
            raise StepFailedError('pip', 1, '')
        runner.effect(arguments)

    carry_out(plan(environment, target), replace(runner, effect=damaged))
    assert titles(environment, target) == []


def test_foreign_venv_is_not_touched(environment: Environment, layout: Layout, fake: Fake) -> None:
    """A .venv that the set-up did not make is refused, and nothing in it is lost."""
    theirs = layout.venv / 'their' / 'work'
    theirs.mkdir(parents=True)
    with pytest.raises(WorkspaceError, match='not made by this set-up'):
        carry_out(plan(environment, Target(build=False)), fake())
    assert theirs.exists()


@pytest.mark.usefixtures('packages')
def test_one_failed_package_does_not_cost_the_others(
    environment: Environment, layout: Layout, fake: Fake
) -> None:
    """What was built before an error is kept; the failed one is tried again."""
    carry_out(plan(environment, Target(build=False)), fake())
    runner = fake()

    def effect(arguments: list[str]) -> None:
        runner.effect(arguments)
        (layout.install / 'share' / 'quad_msgs' / 'package.xml').unlink(missing_ok=True)

    with pytest.raises(StepFailedError, match='quad_msgs'):
        carry_out(plan(environment, Target()), replace(runner, effect=effect))
    assert titles(environment, Target()) == ['Building quad_msgs']


@pytest.mark.usefixtures('packages')
@pytest.mark.parametrize(
    ('extra', 'title'),
    [('training', 'Installing what training imports'), (DOCS, 'Installing what makes the manual')],
)
def test_an_extra_is_installed_only_where_it_is_wanted(
    environment: Environment, layout: Layout, fake: Fake, extra: str, title: str
) -> None:
    """Once, and with nothing else; one that is not pinned is refused by its name."""
    (layout.requirements / f'{extra}.txt').write_text('learner==1\n')
    carry_out(plan(environment, Target()), fake())
    wanted = Target(packages=('arm',), extras=(extra,))
    assert titles(environment, wanted) == [title]
    carry_out(plan(environment, wanted), fake())
    assert titles(environment, wanted) == titles(environment, Target()) == []
    with pytest.raises(WorkspaceError, match=r'flying\.txt'):
        plan(environment, Target(extras=('flying',)))


def test_interpreter_is_kept(environment: Environment, tmp_path: Path) -> None:
    """`make PYTHON=...` once is enough; a vanished interpreter is replaced by the running one."""
    wheels = environment.underlay
    other = tmp_path / 'python3.12'
    other.touch()
    state = EnvironmentState('base', {}, str(other))
    assert choose_python('', wheels, state, environment.python) == str(other)
    other.unlink()
    chosen = choose_python('', wheels, state, environment.python)
    assert chosen == probe(environment.python).path


def test_an_upgraded_interpreter_makes_the_environment_new(
    environment: Environment, tmp_path: Path
) -> None:
    """A python3 that leads to another version than before does not count as the same."""
    name, old, new = (tmp_path / part for part in ('python3', 'python3.11', 'python3.12'))
    name.symlink_to(old)
    mine = replace(environment, python=str(name))
    before = mine.base
    name.unlink()
    name.symlink_to(new)
    assert mine.base != before


def test_the_python_of_a_system_ros_comes_before_one_on_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Conda's lacks what apt installed for Ubuntu's of the same version."""
    running = probe('python3')
    (tmp_path / 'lib' / running.name / 'site-packages' / 'rclpy').mkdir(parents=True)
    own, other = tmp_path / 'bin' / running.name, tmp_path / 'conda' / running.name
    for path in (own, other):
        path.parent.mkdir()
        path.write_text(f'#!/bin/sh\nexec {running.path} "$@"\n')
        path.chmod(0o755)
    monkeypatch.setenv('PATH', f'{other.parent}:/usr/bin:/bin')
    system = Underlay(UnderlayKind.SYSTEM, tmp_path)
    assert system.python == str(own)
    own.unlink()
    assert system.python in {f'/usr/bin/{running.name}', running.name}


@pytest.mark.parametrize('jobs', [1, 2, 3, 16])
def test_compilers_of_all_packages_are_limited_together(
    jobs: int, environment: Environment, runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Workers of colcon times jobs of make; on a small computer each takes much of its memory."""
    seen: list[int] = []

    def run(_runner: Runner, _what: str, arguments: list[str], **options: Any) -> None:
        workers = int(arguments[arguments.index('--parallel-workers') + 1])
        seen.append(workers * int(options['extra']['MAKEFLAGS'].removeprefix('-j')))

    monkeypatch.setattr(Runner, 'run', run)
    Builder(environment.layout, 'base', UnderlayKind.SYSTEM, jobs).build(runner, {}, [])
    assert 0 < max(seen) <= jobs


def test_uv_gets_the_index_of_pip(tmp_path: Path) -> None:
    """From pip.conf or PIP_INDEX_URL, of which the latter counts; uv's own setting wins."""
    config = tmp_path / 'pip.conf'
    config.write_text('[global]\nindex-url = https://mirror.invalid/simple\n')
    environ = {'PIP_CONFIG_FILE': str(config), 'PATH': os.environ['PATH']}
    python = Path(sys.executable)
    key = 'UV_DEFAULT_INDEX'
    assert uv_settings(environ, python)[key] == 'https://mirror.invalid/simple'
    named = environ | {'PIP_INDEX_URL': 'https://other.invalid/simple'}
    assert uv_settings(named, python)[key] == 'https://other.invalid/simple'
    assert key not in uv_settings(named | {key: 'https://own.invalid'}, python)


def test_system_ros_decides_on_the_python(tmp_path: Path) -> None:
    """The venv beside a system's ROS is made by the Python that this ROS is built for."""
    name = f'python3.{probe("python3").version[1]}'
    (tmp_path / 'lib' / name / 'site-packages' / 'rclpy').mkdir(parents=True)
    (tmp_path / 'python3.1').touch()
    of_wheels = EnvironmentState('base', {}, str(tmp_path / 'python3.1'))
    for state in (None, of_wheels):
        chosen = choose_python('', Underlay(UnderlayKind.SYSTEM, tmp_path), state, '/bin/false')
        assert probe(chosen).name == name
