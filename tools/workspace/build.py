# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Builds with colcon what has changed, and only that."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import os
from pathlib import Path
import shutil

from .errors import StepFailedError
from .layout import Layout
from .packages import Package, source_fingerprint
from .process import Runner
from .state import fingerprint, write_atomically
from .underlay import UnderlayKind

PACKAGES_AT_A_TIME = 2
STAMP = '.workspace-fingerprint'
_NEWS = ('Starting >>>', 'Finished <<<', 'Failed')


def default_jobs() -> int:
    """Return a compiler a core, and not more than one for each GiB of memory."""
    memory = os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') // 2**30
    return max(1, min(len(os.sched_getaffinity(0)), memory))


@dataclass(frozen=True, slots=True)
class Builder:
    """Knows what colcon's folders hold, and brings them up to date.

    Attributes:
        layout: Where things are.
        base: Fingerprint of the environment that the packages are built in.
        kind: Where ROS comes from.
        jobs: Greatest number of compilers at the same time.
    """

    layout: Layout
    base: str
    kind: UnderlayKind
    jobs: int

    @property
    def cmake_arguments(self) -> list[str]:
        """What every CMake package is configured with."""
        arguments = ['-DBUILD_TESTING=OFF', f'-DPython3_EXECUTABLE={self.layout.venv_python}']
        if self.kind is UnderlayKind.WHEELS:
            include = self.layout.root / 'tools' / 'cmake' / 'c_type_support_only.cmake'
            arguments.append(f'-DCMAKE_PROJECT_INCLUDE={include}')
        return arguments

    def fingerprints(self, packages: Mapping[str, Package]) -> dict[str, str]:
        """Hash each package with the environment and with the interfaces that it is built on.

        Args:
            packages: Each after those that it needs.
        """
        hashes: dict[str, str] = {}
        for name, package in packages.items():
            below = [
                hashes[other]
                for other in sorted(package.dependencies & hashes.keys())
                if package.is_interface and packages[other].is_interface
            ]
            arguments = self.cmake_arguments if package.build_type == 'ament_cmake' else []
            source = source_fingerprint(package)
            hashes[name] = fingerprint(self.base, *arguments, *below, source)
        return hashes

    def stale(self, hashes: Mapping[str, str]) -> list[str]:
        """Name the packages that are not built, or built from something else."""
        whole = (self.layout.install / 'local_setup.bash').is_file()
        return [name for name, value in hashes.items() if not whole or self._built(name) != value]

    def _built(self, name: str) -> str:
        installed = self.layout.install / name / 'share' / name / 'package.xml'
        return self._stamp(name)[1] if installed.is_file() else ''

    def _stamp(self, name: str) -> tuple[str, str]:
        path = self.layout.build / name / STAMP
        if not path.is_file():
            return '', ''
        base, _, value = path.read_text(encoding='utf-8').partition('\n')
        return base, value

    def remove(self, names: Iterable[str]) -> None:
        """Remove what was built of packages."""
        for name in names:
            # the build folder first: it holds the stamp
            for folder in (self.layout.build / name, self.layout.install / name):
                shutil.rmtree(folder, ignore_errors=True)

    def leftovers(self, wanted: Iterable[str]) -> list[str]:
        """Name what is installed and of no use any more.

        Args:
            wanted: The packages of the workspace that are not the underlay's.
        """
        keep = set(wanted)
        marks = self.layout.install.glob('*/share/colcon-core/packages/*')
        names = {mark.name for mark in marks}
        return sorted(
            name for name in names if name not in keep or self._stamp(name)[0] != self.base
        )

    def build(self, runner: Runner, packages: Mapping[str, Package], stale: list[str]) -> None:
        """Build packages from nothing.

        Args:
            runner: Starts colcon.
            packages: All that are to be there afterwards, each after those that it needs.
            stale: Names of those to build.

        Raises:
            StepFailedError: One of them does not build; the others keep their result.
        """
        hashes = self.fingerprints(packages)
        self.remove(stale)
        try:
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
        return result.is_file() and result.read_text(encoding='utf-8').strip() == '0'

    def _colcon(self, runner: Runner, packages: Mapping[str, Package], stale: list[str]) -> None:
        workers = min(self.jobs, PACKAGES_AT_A_TIME)
        folders = [package.folder for package in packages.values()]
        colcon: list[str | Path] = [self.layout.venv_python, '-m', 'colcon']
        colcon += ['--log-base', self.layout.log, 'build', '--symlink-install']
        colcon += ['--build-base', self.layout.build, '--install-base', self.layout.install]
        colcon += ['--parallel-workers', str(workers), '--event-handlers', 'console_direct-']
        colcon += ['--paths', *folders, '--packages-select', *stale]
        colcon += ['--cmake-args', *self.cmake_arguments]
        setup = self.layout.venv / 'local_setup.bash'
        runner.run(
            'Building the packages',
            ['bash', '-c', '. "$0" && exec "$@"', setup, *colcon],
            show=lambda line: line.startswith(_NEWS),
            # without it colcon adds a load limit, and on a busy machine compiles one by one
            extra={'MAKEFLAGS': f'-j{max(1, self.jobs // workers)}'},
        )
