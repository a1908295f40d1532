# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs the programs of the set-up, and distinguishes network from other failures."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
import contextlib
from dataclasses import dataclass
import fcntl
import os
from pathlib import Path
import re
import subprocess
from typing import TypeAlias

from .layout import NetworkError, StepFailedError

TAIL_LINES = 25
_UNREACHABLE = re.compile(
    'dns error|failed to lookup address|name resolution|Name or service not known'
    '|Network is unreachable|No route to host|Connection refused|Connection reset'
    '|NewConnectionError|ConnectTimeout|Failed to connect|tcp connect error|Max retries exceeded',
    re.IGNORECASE,
)
# of another ROS, another environment or an outer make: must not leak into what we build
_FOREIGN = re.compile(
    'AMENT_|COLCON_|CMAKE_PREFIX_PATH|PYTHONPATH|PYTHONHOME|PYTHONSAFEPATH|VIRTUAL_ENV|ROS_DISTRO'
    '|ROS_VERSION|ROS_PYTHON_VERSION|LD_LIBRARY_PATH|_ROS_WHEELS|MAKEFLAGS|MFLAGS|MAKELEVEL'
)
Argument: TypeAlias = str | Path


@contextlib.contextmanager
def exclusive(path: Path) -> Iterator[int]:
    """Hold a lock file during the block; wait for another holder and print that.

    The lock ends with its last holder, even a killed one. Programs that inherit the descriptor
    hold it, too, so orphans of a killed set-up make the next one wait.
    """
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print('Waiting for another set-up in this checkout ...', flush=True)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield descriptor
    finally:
        os.close(descriptor)


def clean_environment(environ: Mapping[str, str]) -> dict[str, str]:
    """Copy an environment without variables of another ROS, Python or make."""
    kept = {name: value for name, value in environ.items() if not _FOREIGN.match(name)}
    own = {'PIP_DISABLE_PIP_VERSION_CHECK': '1', 'PYTHONUNBUFFERED': '1'}
    return {**kept, **own, 'NO_MKDOCS_2_WARNING': '1'}


@dataclass(frozen=True, slots=True)
class Runner:
    """Starts programs in a clean environment."""

    environ: Mapping[str, str]  # environment to clean and pass on
    cwd: Path  # folder to run in
    lock: int  # descriptor of the set-up's lock, held by the programs too

    def run(
        self,
        what: str,
        arguments: Sequence[Argument],
        *,
        show: tuple[str, ...] = (),
        extra: Mapping[str, str] | None = None,
    ) -> None:
        """Run a program to its end; show lines of its output that begin with one of `show`.

        Raises:
            NetworkError: It failed because there is no connection.
            StepFailedError: It failed for another reason.
        """
        tail: deque[str] = deque(maxlen=TAIL_LINES)
        with subprocess.Popen(
            [str(argument) for argument in arguments],
            env={**clean_environment(self.environ), **(extra or {})},
            cwd=self.cwd,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors='replace',
            pass_fds=(self.lock,),
        ) as process:
            for line in process.stdout or ():
                tail.append(line.rstrip())
                if line.lstrip().startswith(show):
                    print(f'      {line.strip()}', flush=True)
        if process.returncode:
            output = '\n'.join(tail)
            if _UNREACHABLE.search(output):
                raise NetworkError(what)
            raise StepFailedError(what, process.returncode, output)
