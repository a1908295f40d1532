# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs the Python examples of a README in the working directory, and compares what `>>>` shows.

    python readme_examples.py README.md

A block behind the comment ``<!--- skip: next -->`` is passed over.
"""

from __future__ import annotations

from doctest import ELLIPSIS
from pathlib import Path
import sys

from sybil import Sybil
from sybil.parsers.markdown import PythonCodeBlockParser, SkipParser


def run(path: Path) -> int:
    """Run the examples of a README in order, as one program; return how many there were.

    Raises:
        SybilFailure: One shows something else.
    """
    sybil = Sybil([PythonCodeBlockParser(doctest_optionflags=ELLIPSIS), SkipParser()])
    examples = list(sybil.parse(path))
    for example in examples:
        example.evaluate()
    return len(examples)


if __name__ == '__main__':
    sys.stdout.write(f'{run(Path(sys.argv[1]))} examples\n')
