# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Builds only changed packages: by colcon on a system's ROS, by itself on wheels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import json
import os
from pathlib import Path
import shutil

from . import interfaces, link, shell
from .layout import fingerprint, fingerprint_files, Layout, StepFailedError, write_atomically
from .packages import Package, source_fingerprint
from .process import Runner
from .underlay import UnderlayKind

PACKAGES_AT_A_TIME = 2
STAMP = '.workspace-fingerprint'
COLCON_LAYOUT = '.colcon_install_layout'
"""File in which colcon records whether packages share one prefix; ours on wheels do."""
_NEWS = ('Starting >>>', 'Finished <<<', 'Failed')


def default_jobs() -> int:
    """Return one job per core, but at most one per GiB of memory."""
    memory = os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') // 2**30
    return max(1, min(len(os.sched_getaffinity(0)), memory))


@dataclass(frozen=True, slots=True)
class Builder:
    """Tracks the contents of colcon's folders, and updates them."""

    layout: Layout  # where things are
    base: str  # fingerprint of the environment that the packages are built in
    kind: UnderlayKind  # where ROS comes from
    jobs: int  # greatest number of compilers at the same time

    @property
    def _on_wheels(self) -> bool:
        return self.kind is UnderlayKind.WHEELS

    def fingerprints(self, packages: Mapping[str, Package]) -> dict[str, str]:
        """Hash each package with the environment and the interfaces that it is built on."""
        hashes: dict[str, str] = {}
        for name, package in packages.items():
            tools = [interfaces if package.is_interface else link] if self._on_wheels else []
            how = fingerprint_files(Path(tool.__file__ or '') for tool in tools)
            below = [
                hashes[other]
                for other in sorted(package.dependencies & hashes.keys())
                if package.is_interface and packages[other].is_interface
            ]
            hashes[name] = fingerprint(self.base, how, *below, source_fingerprint(package))
        return hashes

    def stale(self, hashes: Mapping[str, str]) -> list[str]:
        """Return the packages that are not built, or built from other sources."""
        whole = (self.layout.install / 'local_setup.bash').is_file() and self._has_our_layout()
        return [name for name, value in hashes.items() if not whole or self._built(name) != value]

    def _has_our_layout(self) -> bool:
        """Return whether the install layout is the one for this kind of ROS."""
        path = self.layout.install / COLCON_LAYOUT
        layout = path.read_text(encoding='utf-8').strip() if path.is_file() else ''
        return (layout == 'merged') == self._on_wheels

    def _manifest(self, name: str) -> Path:
        install = self.layout.install
        return (install if self._on_wheels else install / name) / 'share' / name / 'package.xml'

    def _built(self, name: str) -> str:
        return self._stamp(name)[1] if self._manifest(name).is_file() else ''

    def _stamp(self, name: str) -> tuple[str, str]:
        path = self.layout.build / name / STAMP
        if not path.is_file():
            return '', ''
        base, _, value = path.read_text(encoding='utf-8').partition('\n')
        return base, value

    def remove(self, names: Iterable[str]) -> None:
        """Remove the build results of packages."""
        install = self.layout.install
        for name in names:
            # the build folder first: it holds the stamp
            shutil.rmtree(self.layout.build / name, ignore_errors=True)
            shutil.rmtree(install / name, ignore_errors=True)
            made = [install / folder / name for folder in ('include', 'lib', 'share', link.PYTHON)]
            index = install / 'share' / 'ament_index' / 'resource_index'
            made += [kind / name for kind in index.glob('*')]
            made += (install / 'lib').glob(f'lib{name}__*.so')
            made += (install / link.PYTHON).glob(f'{name}-*.dist-info')
            # links to modules and marks of other names
            made += [
                path
                for path in [*(install / link.PYTHON).glob('*'), *index.glob('packages/*')]
                if path.is_symlink() and name in path.readlink().parts[-3:-1]
            ]
            for path in made:
                if path.is_dir() and not path.is_symlink():
                    shutil.rmtree(path)
                else:
                    path.unlink(missing_ok=True)

    def leftovers(self, wanted: Iterable[str]) -> list[str]:
        """Return installed packages that are not wanted."""
        keep = set(wanted)
        prefixes = '' if self._on_wheels else '*/'
        marks = self.layout.install.glob(f'{prefixes}share/ament_index/resource_index/packages/*')
        # a second name of a package, for its programs, has no folder
        names = {mark.name for mark in marks if (mark.parents[3] / mark.name).is_dir()}
        return sorted(
            name for name in names if name not in keep or self._stamp(name)[0] != self.base
        )

    def build(self, runner: Runner, packages: Mapping[str, Package], stale: list[str]) -> None:
        """Build the stale packages from scratch; each follows its dependencies.

        Raises:
            WorkspaceError: A package does not build; the others keep their result.
        """
        hashes = self.fingerprints(packages)
        if not self._has_our_layout():
            shutil.rmtree(self.layout.install, ignore_errors=True)
        self.remove(stale)
        try:
            if self._on_wheels:
                self._build_on_wheels(runner, packages, stale)
            else:
                self._colcon(runner, packages, stale)
        finally:
            for name in stale:
                if self._succeeded(name):
                    stamp = self.layout.build / name / STAMP
                    write_atomically(stamp, f'{self.base}\n{hashes[name]}')
        failed = [name for name in stale if self._built(name) != hashes[name]]
        if failed:
            raise StepFailedError(f'Building {", ".join(failed)}', 1, 'see the folder log/')

    def _succeeded(self, name: str) -> bool:
        result = self.layout.build / name / 'colcon_build.rc'
        if result.is_file():
            return result.read_text(encoding='utf-8').strip() == '0'
        return self._on_wheels and self._manifest(name).is_file()

    def _build_on_wheels(
        self, runner: Runner, packages: Mapping[str, Package], stale: list[str]
    ) -> None:
        install = self.layout.install
        install.mkdir(exist_ok=True)
        (install / 'COLCON_IGNORE').touch()
        (install / COLCON_LAYOUT).write_text('merged\n', encoding='utf-8')
        shell.write_install_scripts(self.layout.venv, install, install / link.PYTHON)
        for_colcon = []
        for name in stale:
            if packages[name].build_type == 'ament_python':
                link.link_package(packages[name], install, self.layout.venv_python)
            elif not packages[name].is_interface:
                for_colcon.append(name)
        self._build_interfaces(runner, packages, stale)
        if for_colcon:
            self._colcon(runner, packages, for_colcon)
            shell.write_install_scripts(self.layout.venv, install, install / link.PYTHON)

    def _build_interfaces(
        self, runner: Runner, packages: Mapping[str, Package], stale: list[str]
    ) -> None:
        names = [name for name in stale if packages[name].is_interface]
        if not names:
            return
        request = {
            'build': str(self.layout.build),
            'install': str(self.layout.install),
            'jobs': self.jobs,
            'workers': self._workers,
            'packages': {
                name: {
                    'folder': str(packages[name].folder),
                    'needs': sorted(packages[name].dependencies & {*names}),
                }
                for name in names
            },
        }
        runner.run(
            'Building the interfaces',
            [self.layout.venv_python, Path(interfaces.__file__), json.dumps(request)],
            show=_NEWS,
            # with it the interpreter starts once
            extra={'LD_LIBRARY_PATH': str(self.layout.venv / 'lib')},
        )

    @property
    def _workers(self) -> int:
        return min(self.jobs, PACKAGES_AT_A_TIME)

    def _colcon(self, runner: Runner, packages: Mapping[str, Package], names: list[str]) -> None:
        folders = [package.folder for package in packages.values()]
        colcon: list[str | Path] = [self.layout.venv_python, '-m', 'colcon']
        colcon += ['--log-base', self.layout.log, 'build', '--symlink-install']
        colcon += ['--merge-install'] if self._on_wheels else []
        colcon += ['--build-base', self.layout.build, '--install-base', self.layout.install]
        colcon += ['--parallel-workers', str(self._workers), '--event-handlers', 'console_direct-']
        colcon += ['--paths', *folders, '--packages-select', *names, '--cmake-args']
        colcon += ['-DBUILD_TESTING=OFF', f'-DPython3_EXECUTABLE={self.layout.venv_python}']
        setup = self.layout.venv / 'local_setup.bash'
        runner.run(
            'Building the packages',
            ['bash', '-c', '. "$0" && exec "$@"', setup, *colcon],
            show=_NEWS,
            # without it colcon adds a load limit, and on a busy machine compiles one by one
            extra={'MAKEFLAGS': f'-j{max(1, self.jobs // self._workers)}'},
        )
