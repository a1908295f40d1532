# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs the Python examples of READMEs where and beside what they are written for.

As a program, ``python readme_examples.py README.md``, it runs those of one README in the working
directory, and compares what `>>>` shows; it needs Sybil alone. A block behind the comment
``<!--- skip: next -->`` is passed over.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from doctest import ELLIPSIS
from pathlib import Path
import subprocess
import sys

CHECKOUT = Path(__file__).parents[1]
READMES = (
    'arm_canopen',
    'arm_model',
    'arm_planning',
    'arm_servo',
    'arm_trajectory',
    'canopen_core',
    'canopen_sim',
    'canopen_tools',
    'quad_controller',
    'quad_description',
    'quad_hardware',
    'quad_sim',
    'robot_viewer',
)
"""Packages that are libraries without ROS, too."""
PORT = '/dev/ttyAMA0'  # of the robot, in the READMEs
TIMEOUT = 120.0  # [s]


def run_examples(
    package: str, folder: Path, python: str | Path, env: Mapping[str, str]
) -> subprocess.CompletedProcess[str]:
    """Run the examples of a README at the top of the checkout, beside a simulated XGO.

    Args:
        package: The package.
        folder: An empty folder.
        python: The interpreter whose packages are used.
        env: Environment of the processes; its ROS domain chooses the CAN bus.
    """
    text = (CHECKOUT / package / 'README.md').read_text()
    readme, port = folder / 'README.md', folder / 'xgo'
    readme.write_text(text.replace(PORT, str(port)))
    with ExitStack() as stack:
        if PORT in text:
            board = [sys.executable, '-m', 'quad_sim.fake_xgo', '--no-ros', '--link', str(port)]
            process = stack.enter_context(
                subprocess.Popen(board, stdout=subprocess.PIPE, start_new_session=True)
            )
            stack.callback(process.terminate)
            assert process.stdout is not None
            assert process.stdout.readline()  # it is there
        return subprocess.run(
            [python, __file__, readme],
            cwd=CHECKOUT,
            env=env,
            start_new_session=True,  # its robots do not share the processor of all tests
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=False,
        )


def run(path: Path) -> int:
    """Run the examples of a README in order, as one program; return how many there were.

    Raises:
        SybilFailure: One shows something else.
    """
    from sybil import Sybil
    from sybil.parsers.markdown import PythonCodeBlockParser, SkipParser

    sybil = Sybil([PythonCodeBlockParser(doctest_optionflags=ELLIPSIS), SkipParser()])
    examples = list(sybil.parse(path))
    for example in examples:
        example.evaluate()
    return len(examples)


if __name__ == '__main__':
    sys.stdout.write(f'{run(Path(sys.argv[1]))} examples\n')
