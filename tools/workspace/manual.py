# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Builds the manual as a site, without a network."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
import subprocess

from .layout import Layout
from .process import clean_environment


def mkdocs_command(layout: Layout) -> list[str | Path]:
    """Return the command that builds the site in build/site, a warning being an error."""
    mkdocs, settings = layout.venv / 'bin' / 'mkdocs', layout.root / 'mkdocs.yml'
    return [mkdocs, 'build', '--quiet', '--strict', '--config-file', settings]


def build_manual(layout: Layout, environ: Mapping[str, str]) -> int:
    """Build the site and print where it begins; return 0, or 1 when it fails."""
    environment = clean_environment(environ)
    done = subprocess.run(mkdocs_command(layout), cwd=layout.root, env=environment, check=False)
    if done.returncode:
        return 1
    site = layout.build / 'site'
    print(f'The manual: {site / "index.html"}')
    print(f'With a search field: python3 -m http.server --bind 127.0.0.1 --directory {site}')
    return 0
