# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 pkg list`, `executables`, `prefix` and `xml`."""

from __future__ import annotations

from argparse import Namespace
from xml.etree import ElementTree as ET

from ..cli.commands import argument, flag, FrontendError, UnknownNameError, verb
from ..index import executables, package_prefixes, prefix_of

_NOT_FOUND = 'Package not found'
_PACKAGE = argument('package_name', help='The package name')


@verb()
def list_names(_: Namespace) -> None:
    """Print the names of all packages, sorted."""
    for name in package_prefixes():
        print(name)


@verb(
    argument('package_name', nargs='?', help='The package name'),
    flag('--full-path', help='Show full path of each executable'),
)
def list_executables(args: Namespace) -> None:
    """Print package and executable, one pair per line."""
    for package in [args.package_name] if args.package_name else package_prefixes():
        for path in executables(package):
            print(path if args.full_path else f'{package} {path.name}')


@verb(_PACKAGE, flag('--share', help='Show share directory for the package'))
def prefix(args: Namespace) -> None:
    """Print the path of a package."""
    path = prefix_of(args.package_name, _NOT_FOUND)
    print(path / 'share' / args.package_name if args.share else path)


@verb(_PACKAGE, argument('-t', '--tag', help='The XML tag to output, e.g. version'))
def xml(args: Namespace) -> None:
    """Print the manifest or the text of each of its elements with the tag."""
    share = prefix_of(args.package_name, _NOT_FOUND) / 'share' / args.package_name
    manifest = share / 'package.xml'
    if not manifest.is_file():
        raise UnknownNameError('Package xml manifest not found')
    tree = ET.parse(manifest)  # noqa: S314
    if args.tag is None:
        ET.dump(tree)
        return
    elements = tree.getroot().findall(args.tag)
    if not elements:
        raise FrontendError('XML tag not found')
    for element in elements:
        print(element.text)
