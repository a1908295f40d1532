# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 pkg list`, `executables`, `prefix` and `xml`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from xml.etree import ElementTree as ET

from ..cli.errors import FrontendError, UnknownNameError
from ..index.packages import executables, package_prefixes, prefix_of

_NOT_FOUND = 'Package not found'


class List:
    """Output a list of available packages."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add no argument.

        Args:
            parser: The command's parser.
        """

    def main(self, args: Namespace) -> None:
        """Print the names, sorted."""
        for name in package_prefixes():
            print(name)


class Executables:
    """Output a list of package specific executables."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        parser.add_argument('package_name', nargs='?', help='The package name')
        parser.add_argument(
            '--full-path', action='store_true', help='Show full path of each executable'
        )

    def main(self, args: Namespace) -> None:
        """Print package and executable, one pair per line.

        Raises:
            UnknownNameError: When there is no such package.
        """
        names = [args.package_name] if args.package_name else package_prefixes()
        for package in names:
            for path in executables(package):
                print(path if args.full_path else f'{package} {path.name}')


class Prefix:
    """Output the prefix path of a package."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        parser.add_argument('package_name', help='The package name')
        parser.add_argument(
            '--share', action='store_true', help='Show share directory for the package'
        )

    def main(self, args: Namespace) -> None:
        """Print the path.

        Raises:
            UnknownNameError: When there is no such package.
        """
        prefix = prefix_of(args.package_name, _NOT_FOUND)
        print(prefix / 'share' / args.package_name if args.share else prefix)


class Xml:
    """Output the XML of the package manifest or a specific tag."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        parser.add_argument('package_name', help='The package name')
        parser.add_argument('-t', '--tag', help='The XML tag to output, e.g. version')

    def main(self, args: Namespace) -> None:
        """Print the manifest or the text of each of its elements with the tag.

        Raises:
            UnknownNameError: When there is no such package.
            FrontendError: When it has no manifest or no such tag.
        """
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
