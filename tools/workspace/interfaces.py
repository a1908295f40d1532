# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Builds interface packages if ROS comes from wheels; run by the environment's own Python.

CMake starts an interpreter per generator, and each parses every interface again; here all
generators of a package share one process. Their output becomes one library, with links for the
names of the five that CMake makes. rclpy loads only the C type supports, so C++ ones are omitted.
With a system's ROS, CMake builds the packages, for rosbag2 and rviz2 too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
import compileall
from concurrent.futures import ThreadPoolExecutor
import importlib
import json
import os
from pathlib import Path
import shutil
import subprocess
import sys
import sysconfig
from typing import Any

KINDS = ('msg', 'srv', 'action')
WITH_HEADERS = (
    'rosidl_generator_c',
    'rosidl_typesupport_fastrtps_c',
    'rosidl_typesupport_introspection_c',
)
GENERATORS: dict[str, tuple[Any, ...]] = {
    'rosidl_generator_c': ('rosidl_generator_c', 'generate_c'),
    'rosidl_typesupport_fastrtps_c': (
        'rosidl_typesupport_fastrtps_c',
        'generate_typesupport_fastrtps_c',
    ),
    'rosidl_typesupport_introspection_c': ('rosidl_typesupport_introspection_c', 'generate_c'),
    'rosidl_typesupport_c': ('rosidl_typesupport_c', 'generate_c', WITH_HEADERS[1:]),
    'rosidl_generator_py': (
        'rosidl_generator_py.generate_py_impl',
        'generate_py',
        ['rosidl_typesupport_c'],
    ),
}
"""Module and function of each generator, and its arguments besides the arguments file."""
DESCRIPTIONS = 'rosidl_generator_type_description'
COMPILERS = ('c++', 'g++', 'clang++')
FILES_TOGETHER = 32
"""Sources per translation unit: most of the time goes into reading the same headers."""


class Workshop:
    """Builds and installs one interface package.

    Attributes:
        name: Name of the package.
        source: Source folder of the package.
        work: Folder of generated files.
        install: Prefix of the installation.
        prefixes: Prefixes of its dependencies.
    """

    def __init__(self, name: str, source: Path, build: Path, install: Path) -> None:
        self.name, self.source, self.work, self.install = name, source, build / name, install
        self.prefixes = (Path(sys.prefix), install)
        found = (path for kind in KINDS for path in (source / kind).glob(f'*.{kind}'))
        self.interfaces = sorted(path.relative_to(source) for path in found)

    def output(self, generator: str) -> Path:
        """Return the output folder of a generator, for the compiler options."""
        return self.work / generator

    def generate(self) -> None:
        """Run all generators."""
        convert = importlib.import_module('rosidl_adapter').convert_to_idl
        idl = self.output('rosidl_adapter') / self.name
        for interface in self.interfaces:
            convert(self.source, self.name, interface, idl)
        shares = [share for prefix in self.prefixes for share in (prefix / 'share').iterdir()]
        paths = self._arguments(
            DESCRIPTIONS, include_paths=[f'{share.name}:{share}' for share in shares]
        )
        importlib.import_module(DESCRIPTIONS).generate_type_hash(paths)
        for generator, (module, function, *more) in GENERATORS.items():
            arguments = self._arguments(
                generator,
                template_dir=f'{sys.prefix}/share/{generator}/resource',
                ros_interface_files=[str(self.source / path) for path in self.interfaces],
                target_dependencies=[],
                type_description_tuples=[
                    f'{path.with_suffix(".idl")}:{self._described(path)}'
                    for path in self.interfaces
                ],
            )
            getattr(importlib.import_module(module), function)(arguments, *more)
        for generator in WITH_HEADERS:
            self._write_visibility(generator)

    def _described(self, interface: Path) -> Path:
        folder = self.output(DESCRIPTIONS) / self.name
        return folder / interface.with_suffix('.json')

    def _arguments(self, generator: str, **more: object) -> str:
        """Write the input file of a generator, as CMake would."""
        idl = self.output('rosidl_adapter') / self.name
        content = {
            'package_name': self.name,
            'output_dir': str(self.output(generator) / self.name),
            'idl_tuples': [f'{idl}:{path.with_suffix(".idl")}' for path in self.interfaces],
            **more,
        }
        path = self.work / f'{generator}.json'
        path.write_text(json.dumps(content), encoding='utf-8')
        return str(path)

    def _write_visibility(self, generator: str) -> None:
        header = f'{generator}__visibility_control.h'
        template = Path(sys.prefix, 'share', generator, 'resource', f'{header}.in').read_text()
        text = template.replace('@PROJECT_NAME@', self.name)
        path = self.output(generator) / self.name / 'msg' / header
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.replace('@PROJECT_NAME_UPPER@', self.name.upper()))

    def compile(self, jobs: int) -> None:
        """Compile the library.

        Args:
            jobs: Number of parallel compilers.
        """
        compiler = next(path for name in COMPILERS if (path := shutil.which(name)))
        folders = [self.output(generator) for generator in GENERATORS]
        for prefix in self.prefixes:
            include = prefix / 'include'
            folders += [include, *sorted(include.iterdir())] if include.is_dir() else []
        numpy = importlib.import_module('numpy')
        folders += [Path(sysconfig.get_path('include')), Path(numpy.get_include())]
        options = ['-fPIC', '-w', *(f'-I{folder}' for folder in folders)]
        options += [f'-D{name.upper()}_BUILDING_DLL_{self.name}' for name in WITH_HEADERS]
        units = [*self._units()]

        def one(unit: Path) -> None:
            language = ['-x', 'c'] if unit.suffix == '.c' else ['-x', 'c++', '-std=c++17']
            _run([compiler, *options, *language, '-c', unit, '-o', unit.with_suffix('.o')])

        with ThreadPoolExecutor(jobs) as pool:
            list(pool.map(one, units))
        self._library.parent.mkdir(parents=True, exist_ok=True)
        libraries = [prefix / 'lib' for prefix in reversed(self.prefixes)]
        needed = sorted(
            path for folder in libraries for path in folder.glob('lib*.so') if _is_needed(path)
        )
        link = ['-shared', '-Wl,--as-needed', *(f'-Wl,-rpath,{folder}' for folder in libraries)]
        objects = [unit.with_suffix('.o') for unit in units]
        named = f'-Wl,-soname,{self._library.name}'
        linked = self.work / self._library.name
        _run([compiler, *link, named, '-o', linked, *objects, *needed])
        _move(linked, self._library)

    @property
    def _library(self) -> Path:
        return self.install / 'lib' / f'lib{self.name}__rosidl.so'

    def _units(self) -> Iterator[Path]:
        """Write the translation units; type descriptions stay separate, for their static names."""
        for generator in GENERATORS:
            found = sorted(self.output(generator).rglob('*.c*'))
            alone = [path for path in found if path.name.endswith('__description.c')]
            alone += self.output(generator).rglob('*.ep.*.c')
            yield from alone
            together = [path for path in found if path not in alone]
            for begin in range(0, len(together), FILES_TOGETHER):
                part = together[begin : begin + FILES_TOGETHER]
                unit = self.work / f'{generator}_{begin}{part[0].suffix}'
                unit.write_text(''.join(f'#include "{path}"\n' for path in part))
                yield unit

    def place(self) -> None:
        """Install the results, the manifest last: it marks the package as built."""
        for generator in WITH_HEADERS:
            for header in (self.output(generator) / self.name).rglob('*.h'):
                path = header.relative_to(self.output(generator))
                _copy(header, self.install / 'include' / self.name / path)
        for name in GENERATORS:
            self._link(self.install / 'lib' / f'lib{self.name}__{name}.so')
        python = self.install / 'lib' / 'python' / self.name
        generated = self.output('rosidl_generator_py') / self.name
        for module in generated.rglob('*.py'):
            _copy(module, python / module.relative_to(generated))
        (python / '__init__.py').touch()
        self._link(python / f'{self.name}_s__rosidl_typesupport_c.so')
        compileall.compile_dir(python, quiet=1)
        share = self.install / 'share'
        for interface in self.interfaces:
            _copy(self.source / interface, share / self.name / interface)
            idl = interface.with_suffix('.idl')
            _copy(self.output('rosidl_adapter') / self.name / idl, share / self.name / idl)
            described = self._described(interface)
            _copy(described, share / self.name / interface.with_suffix('.json'))
        names = {str(path) for path in self.interfaces}
        names |= {str(path.with_suffix('.idl')) for path in self.interfaces}
        index = share / 'ament_index' / 'resource_index'
        for kind, text in (('rosidl_interfaces', '\n'.join(sorted(names))), ('packages', '')):
            (index / kind).mkdir(parents=True, exist_ok=True)
            (index / kind / self.name).write_text(text)
        _copy(self.source / 'package.xml', share / self.name / 'package.xml')

    def _link(self, path: Path) -> None:
        link = self.work / path.name
        link.unlink(missing_ok=True)
        link.symlink_to(self._library)
        _move(link, path)


def _is_needed(library: Path) -> bool:
    """Return whether interface libraries may have to link with a library."""
    name = library.stem
    return name.endswith(('_c', '_py', '__rosidl')) or name in {'librcutils', 'libfastcdr'}


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)


def _move(source: Path, target: Path) -> None:
    """Move a file atomically: packages built in parallel link the files they find."""
    beside = target.with_name(f'{target.name}.new')
    shutil.move(source, beside)
    beside.replace(target)


def _run(command: Sequence[str | Path]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f'{done.stdout}{done.stderr}')


def load_generators() -> None:
    """Import the generators, and make them share parsed interfaces."""
    modules = [
        importlib.import_module(name)
        for name in ('rosidl_pycommon', DESCRIPTIONS, *(name for name, *_ in GENERATORS.values()))
    ]
    parse = importlib.import_module('rosidl_parser.parser').parse_idl_file
    parsed: dict[Path, Any] = {}

    def parse_once(locator: Any) -> Any:  # noqa: ANN401  # without types
        path = locator.get_absolute_path()
        if path not in parsed:
            parsed[path] = parse(locator)
        return parsed[path]

    for module in modules:
        if hasattr(module, 'parse_idl_file'):
            vars(module)['parse_idl_file'] = parse_once


def build(workshop: Workshop, jobs: int) -> None:
    """Build a package from scratch."""
    shutil.rmtree(workshop.work, ignore_errors=True)
    workshop.work.mkdir(parents=True)
    workshop.generate()
    workshop.compile(jobs)
    workshop.place()


def build_all(
    workshops: Mapping[str, Workshop], needs: Mapping[str, Iterable[str]], jobs: int, workers: int
) -> list[str]:
    """Build packages, each in its own process with the generators already loaded.

    Args:
        workshops: The packages by name, each after its dependencies.
        needs: Names of the dependencies of each package.
        jobs: Number of parallel compilers.
        workers: Number of packages built in parallel.

    Returns:
        The names of packages that could not be built.
    """
    load_generators()
    waiting, running = list(workshops), dict[int, str]()
    failed: list[str] = []
    while waiting or running:
        open_names = {*waiting, *running.values()}
        ready = [name for name in waiting if not open_names & {*needs[name]}]
        if ready and len(running) < workers:
            name = ready[0]
            waiting.remove(name)
            if {*failed} & {*needs[name]}:
                failed.append(name)
                continue
            print(f'Starting >>> {name}', flush=True)
            child = os.fork()
            if child == 0:
                _build_and_exit(workshops[name], max(1, jobs // workers))
            running[child] = name
            continue
        if not running:
            print(f'These need each other: {", ".join(waiting)}', file=sys.stderr)
            return failed + waiting
        child, status = os.wait()
        name = running.pop(child)
        print(f'{"Failed   <<<" if status else "Finished <<<"} {name}', flush=True)
        failed += [name] if status else []
    return failed


def _build_and_exit(workshop: Workshop, jobs: int) -> None:
    status = 1
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # generators print a line for each file
        build(workshop, jobs)
        status = 0
    except Exception as error:  # noqa: BLE001  # the other packages go on
        print(f'{workshop.name}: {type(error).__name__}: {error}', file=sys.stderr, flush=True)
    finally:
        os._exit(status)


def main() -> int:
    """Build the packages that the only argument (JSON) names."""
    request = json.loads(sys.argv[1])
    build_folder, install = Path(request['build']), Path(request['install'])
    packages = request['packages']
    workshops = {
        name: Workshop(name, Path(each['folder']), build_folder, install)
        for name, each in packages.items()
    }
    needs = {name: each['needs'] for name, each in packages.items()}
    return 1 if build_all(workshops, needs, request['jobs'], request['workers']) else 0


if __name__ == '__main__':
    sys.exit(main())
