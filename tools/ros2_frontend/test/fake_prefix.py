# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An install prefix made for a test: packages with executables, manifests and definitions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

MANIFEST = """\
<package format="3">
  <name>{name}</name>
  <version>1.2.3</version>
  <depend>one</depend>
  <depend>two</depend>
</package>
"""


def add_package(
    prefix: Path,
    name: str,
    executables: Mapping[str, str] | None = None,
    definitions: Mapping[str, str] | None = None,
) -> None:
    """Install a package.

    Args:
        prefix: Where.
        name: The package's name.
        executables: Scripts by file name, below `lib/<name>`.
        definitions: Interface definitions by path, e.g. `msg/Point.msg`.
    """
    index = prefix / 'share/ament_index/resource_index'
    _write(index / 'packages' / name, '')
    share = prefix / 'share' / name
    _write(share / 'package.xml', MANIFEST.format(name=name))
    for file, text in (executables or {}).items():
        script = prefix / 'lib' / name / file
        _write(script, text)
        script.chmod(0o755)
    if definitions:
        for path, text in definitions.items():
            _write(share / path, text)
        listing = [line for path in definitions for line in (path, f'{path.rsplit(".")[0]}.idl')]
        _write(index / 'rosidl_interfaces' / name, '\n'.join(listing))


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding='utf-8')
