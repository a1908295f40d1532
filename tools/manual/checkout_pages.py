# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Adds the READMEs of the checkout to the site and keeps their links.

A hook of mkdocs. Each page has the path of its file in the checkout, so links between pages of
`docs` and READMEs work in both; only paths in `docs` start at the root of the site.
"""

from __future__ import annotations

import ast
from pathlib import Path
import posixpath
import re
from typing import TYPE_CHECKING

from mkdocs.structure.files import File, Files

if TYPE_CHECKING:
    from collections.abc import Callable

    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
MANUAL = 'docs'
PAGES = ('README.md', 'CHANGELOG.md', '*/README.md', '*/docs/*.md', '*/*/README.md')
OTHER = (MANUAL, 'build', 'install', 'log')
HOME = 'checkout.html'
"""Address of the README of the project: index.html is the home page of the manual."""
LINK = re.compile(r'(?<!\\)(\[[^\]\[]*(?:\[[^\]]*\][^\]\[]*)?\])\(([^()\s]+)\)')
COMMANDS = re.compile(r'^```console\n(?!\$ )', re.MULTILINE)
ROLE = re.compile(r':(?:attr|class|data|exc|func|meth|mod):(?=<code>)')
FENCE = re.compile(r'^( *)(```+).*?^\1\2$', re.MULTILINE | re.DOTALL)


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Move the pages of the manual to their path in the checkout, and add the READMEs."""
    found = Files([])
    for file in files:
        moved = File.generated(
            config, f'{MANUAL}/{file.src_uri}', abs_src_path=str(file.abs_src_path)
        )
        moved.dest_uri = file.dest_uri
        found.append(moved)
    for path in sorted({path for pattern in PAGES for path in ROOT.glob(pattern)}):
        uri = path.relative_to(ROOT).as_posix()
        if uri.split('/')[0] in OTHER:
            continue
        page = File.generated(config, uri, abs_src_path=str(path))
        if uri == 'README.md':
            page.dest_uri = HOME
        found.append(page)
    for uri in sorted(_linked(found)):
        found.append(File.generated(config, uri, abs_src_path=str(ROOT / uri)))
    return found


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Redirect links from folders to their READMEs; replace links that the site lacks by text."""
    del config

    def corrected(match: re.Match[str]) -> str:
        text, target = match.groups()
        place, _, anchor = target.partition('#')
        if not place or ':' in place:
            return match[0]
        uri = _resolved(page.file.src_uri, place)
        if files.get_file_from_path(uri) is not None:
            return match[0]
        if files.get_file_from_path(f'{uri}/README.md') is not None:
            suffix = f'#{anchor}' if anchor else ''
            return f'{text}({place.rstrip("/")}/README.md{suffix})'
        if (ROOT / uri).exists():
            return text[1:-1]
        return match[0]  # mkdocs reports it

    for name, table in TABLES.items():
        marker = f'<!-- table of {name} -->'
        if marker in markdown:
            markdown = markdown.replace(marker, table())
    # without prompts all of it is commands, and nothing what they print
    return _outside_of_blocks(COMMANDS.sub('```bash\n', markdown), corrected)


def on_page_content(html: str, *, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Remove the Sphinx roles of docstrings."""
    del page, config, files
    return ROLE.sub('', html)


def table_of_programs() -> str:
    """Return a table of the executables of all packages, with the first docstring sentence."""
    rows = ['| package | program | what it is |', '|---|---|---|']
    for setup in sorted([*ROOT.glob('*/setup.py'), *ROOT.glob('libraries/*/setup.py')]):
        package = setup.parent
        page = f'../../{package.relative_to(ROOT).as_posix()}/README.md'
        for name, module, function in _executables(setup):
            link = f'[{module.partition(".")[0]}]({page})'
            rows.append(f'| {link} | `{name}` | {_summary(package, module, function)} |')
    return '\n'.join(rows)


def table_of_interfaces() -> str:
    """Return a table of the messages, services and actions here, with their first comment."""
    rows = ['| type | what it is |', '|---|---|']
    for path in sorted(ROOT.glob('*_msgs/*/*')):
        if path.suffix in {'.msg', '.srv', '.action'}:
            lines = path.read_text(encoding='utf-8').splitlines()
            about = (line[2:] for line in lines if re.match('# (?!SPDX)', line))
            name = path.relative_to(ROOT).with_suffix('').as_posix()
            rows.append(f'| `{name}` | {next(about, "")} |')
    return '\n'.join(rows)


TABLES = {'programs': table_of_programs, 'interfaces': table_of_interfaces}


def _executables(setup: Path) -> list[tuple[str, str, str]]:
    """Return name, module and function of each executable of a package."""
    for node in ast.walk(ast.parse(setup.read_text(encoding='utf-8'))):
        match node:
            case ast.keyword(arg='programs', value=value):
                entries = ast.literal_eval(value)
                parts = (re.split(r' = |:', entry) for entry in entries)
                return [(name, module, function) for name, module, function in parts]
    return []


def _summary(package: Path, module: str, function: str) -> str:
    """Return the first docstring sentence of a program's module, or of its function."""
    base = package.joinpath(*module.split('.'))
    path = base / '__init__.py' if base.is_dir() else base.with_suffix('.py')
    tree = ast.parse(path.read_text(encoding='utf-8'))
    found = ast.get_docstring(tree) or ''
    if function != 'main':
        own = (node for node in tree.body if isinstance(node, ast.FunctionDef))
        found = next(
            (ast.get_docstring(node) or '' for node in own if node.name == function), found
        )
    sentence = ' '.join(found.partition('\n\n')[0].split())
    return re.sub(r'^``.*?``: ', '', sentence).replace('``', '`').replace('|', '\\|')


def _linked(files: Files) -> set[str]:
    """List files of the checkout that pages link to and that are no pages."""
    linked = set()
    for file in files.documentation_pages():
        for _, target in LINK.findall(FENCE.sub('', file.content_string)):
            place = target.partition('#')[0]
            uri = _resolved(file.src_uri, place) if place and ':' not in place else ''
            if uri and (ROOT / uri).is_file() and files.get_file_from_path(uri) is None:
                linked.add(uri)
    return linked


def _resolved(page: str, place: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(page), place))


def _outside_of_blocks(markdown: str, corrected: Callable[[re.Match[str]], str]) -> str:
    parts, end = [], 0
    for block in FENCE.finditer(markdown):
        parts += [LINK.sub(corrected, markdown[end : block.start()]), block[0]]
        end = block.end()
    return ''.join([*parts, LINK.sub(corrected, markdown[end:])])
