# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The Python examples of the READMEs run as they are printed."""

from __future__ import annotations

from pathlib import Path
import re
import sys

from isolation import Isolation
import pytest
from readme_folder import CHECKOUT, READMES, run_examples

pytestmark = pytest.mark.slow


@pytest.mark.parametrize('package', READMES)
def test_examples_run(package: str, tmp_path: Path, isolation: Isolation) -> None:
    """In a folder with the files that they name; what `>>>` shows is what comes."""
    done = run_examples(package, tmp_path, sys.executable, isolation.env)
    assert done.returncode == 0, done.stderr
    assert re.search(r'^[1-9]\d* examples$', done.stdout, re.MULTILINE)


def test_no_readme_is_forgotten() -> None:
    """Whoever writes an example has it run."""
    written = {
        path.parent.name
        for path in CHECKOUT.glob('*/README.md')
        if re.search('^```python$', path.read_text(), re.MULTILINE)
    }
    assert written <= set(READMES)
