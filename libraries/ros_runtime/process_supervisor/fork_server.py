# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Starts the Python programs of a bring-up by forking a process that has imported them all.

Imports are half of what the start of a node costs, and the same for most of them. The server loads
them once, beside the supervisor's own preparations, and what is not written to stays one memory.
It has no thread and no ROS context. Each program runs as ``__main__`` with its own session,
output, variables and command line, as if it were executed; the server is its parent, and reports
its exit code. What is no Python program of this interpreter is executed as before.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import contextlib
import ctypes
import gc
import importlib
import json
import os
from pathlib import Path
import select
import signal
import socket
import struct
import subprocess
import sys
from typing import Any, TYPE_CHECKING

from .nodes import ENVIRONMENT, Executable
from .spec import TRACES

if TYPE_CHECKING:
    from typing_extensions import Self

ANSWER_TIMEOUT = 20.0  # longest time in [s] for the imports; then programs are executed
_MESSAGE = 1 << 18  # greatest request in [byte]: argv and environment
_NICE = ('nice', '-n')
_BLOCKED = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
"""For the server, which goes when the supervisor does: its exit codes are wanted until then."""


class Forked:
    """A program that the server has started; as ``subprocess.Popen``."""

    def __init__(self, server: ForkServer, pid: int) -> None:
        self.pid = pid
        self._server = server

    def wait(self) -> int:
        """Return the exit code of the program, which has ended; 1 when the server was killed."""
        code = self._server.request({'pid': self.pid})
        return 1 if code is None else code


class ForkServer:
    """The supervisor's end: starts the server, and asks it for processes.

    Use it as a context manager around :func:`.supervise`.
    """

    def __init__(self, programs: Iterable[Executable]) -> None:
        """Begin to import programs that will be started; others are forked, too."""
        self._link, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._link.settimeout(ANSWER_TIMEOUT)
        code = f'import sys; del sys.path[0]; from {__name__} import main; main()'
        with other:
            self._process = subprocess.Popen(
                [
                    sys.executable,
                    '-c',
                    code,
                    *(f'{each.package}:{each.name}' for each in programs),
                ],
                stdin=other.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env={**os.environ, TRACES: '1', **ENVIRONMENT},  # Python reads some at its start
                start_new_session=True,  # no Ctrl-C of the terminal
            )

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def __enter__(self) -> Self:
        """Nothing more: it imports already."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the server, whatever it imports; programs that run go on."""
        self._link.close()
        self._process.kill()
        self._process.wait()

    def start(
        self, argv: Sequence[str], environment: Mapping[str, str], output: int
    ) -> Forked | None:
        """Start a program; None where it has to be executed."""
        niceness, program = (int(argv[2]), argv[3:]) if (*argv[:2],) == _NICE else (0, argv)
        try:
            with Path(program[0]).open('rb') as file:
                own = file.readline() == f'#!{sys.executable}\n'.encode()
        except OSError:
            own = False
        if not own:
            return None
        asked = {'argv': list(program), 'environment': dict(environment), 'niceness': niceness}
        pid = self.request(asked, output)
        return None if pid is None else Forked(self, pid)

    def request(self, message: Mapping[str, Any], *descriptors: int) -> int | None:
        """Return the answer of the server; None when it does not answer."""
        try:
            socket.send_fds(self._link, [json.dumps(message).encode()], descriptors)
            return int(self._link.recv(_MESSAGE))
        except (OSError, ValueError):  # it was killed, or is late: its answers would be mixed up
            self._link.close()
            return None


def main() -> None:
    """Import the programs of the command line, and fork until the supervisor goes.

    A program is forked as soon as it is imported. In the fork this runs it, and returns.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, _BLOCKED)
    link = socket.socket(fileno=os.dup(sys.stdin.fileno()))
    gc.disable()
    programs = sys.argv[1:]
    while True:
        while programs and not select.select([link], [], [], 0.0)[0]:
            _load(programs.pop(0))
        data, descriptors, _, _ = socket.recv_fds(link, _MESSAGE, 1)
        if not data:
            os._exit(0)  # without the atexit functions of what was imported
        request = json.loads(data)
        if 'pid' in request:
            answer = os.waitstatus_to_exitcode(os.waitpid(request['pid'], 0)[1])
        else:
            file = request['argv'][0]
            while any(file.endswith(each.replace(':', '/')) for each in programs):
                _load(programs.pop(0))
            gc.freeze()
            answer = os.fork()
            if not answer:
                link.close()
                _become(request, *descriptors)
                _run(file)
                return
            os.close(*descriptors)
        link.send(f'{answer}'.encode())


def _load(program: str) -> None:
    from importlib.metadata import distribution

    package, _, name = program.partition(':')
    with contextlib.suppress(Exception):  # the program will report it
        (point,) = distribution(package).entry_points.select(name=name)
        importlib.import_module(point.module)


def _run(file: str) -> None:
    from runpy import run_path

    run_path(file, run_name='__main__')


def _become(request: Mapping[str, Any], output: int) -> None:
    """Give this process what an executed one has."""
    os.setsid()
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)
    os.environ.clear()
    os.environ.update(request['environment'])
    os.nice(request['niceness'])
    sys.argv = request['argv']
    sys.path.insert(0, str(Path(sys.argv[0]).parent))
    _show([sys.executable, *sys.argv])
    gc.enable()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _BLOCKED)


_PR_SET_NAME, _PR_SET_MM, _PR_SET_MM_MAP = 15, 35, 14  # linux/prctl.h
_MAP = struct.Struct('=12Q2I')  # struct prctl_mm_map
_FIELDS = (26, 27, 45, 46, 47, 0, 28, 48, 49, 50, 51)  # of proc(5), stat; 0 is not there
_shown: list[ctypes.Array[ctypes.c_char]] = []  # what the kernel reads for /proc/PID/cmdline


def _show(argv: Sequence[str]) -> None:
    """Show name and command line in ps, as far as the kernel allows that."""
    libc = ctypes.CDLL(None)
    libc.prctl(_PR_SET_NAME, os.fsencode(Path(argv[1]).name))
    libc.sbrk.restype = ctypes.c_void_p
    stat = ['', *Path('/proc/self/stat').read_text().rpartition(') ')[2].split()]
    values = [int(stat[field - 2]) if field else libc.sbrk(0) for field in _FIELDS]
    text = ctypes.create_string_buffer(b'\0'.join(map(os.fsencode, argv)))
    _shown.append(text)
    values[7:9] = [ctypes.addressof(text), ctypes.addressof(text) + len(text)]
    memory = ctypes.create_string_buffer(_MAP.pack(*values, 0, 0, 2**32 - 1), _MAP.size)
    libc.prctl(_PR_SET_MM, _PR_SET_MM_MAP, memory, _MAP.size, 0)
