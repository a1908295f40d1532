# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Hot paths in C, built at first use by the C compiler of the machine.

A library is kept in ``$XDG_CACHE_HOME/<package>/compiled`` (``~/.cache/<package>/compiled``), one
file per source, compiler version, flags and processor. Each has a reference in Python, which is
used if there is no compiler, the build fails, or ``<PACKAGE>_COMPILED=0`` is set.
"""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
import logging
import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import ctypes

FLAGS = ('-O3', '-march=native', '-std=gnu11', '-shared', '-fPIC')
BUILD_TIME = 60.0  # time that the compiler is given in [s]


def cache_folder(package: str) -> Path | None:
    """Return the cache folder of a package; None for a user without a home folder."""
    cache = os.environ.get('XDG_CACHE_HOME')
    try:
        return (Path(cache) if cache else Path.home() / '.cache') / package
    except RuntimeError:
        return None


def load_c_library(
    package: str, source: Path, consequence: str, flags: Sequence[str] = ()
) -> ctypes.CDLL | None:
    """Return the library of a C file; None, with a warning, if it cannot be built or loaded.

    Not thread-safe, and not cached in the process. The warning states the ``consequence``;
    ``package`` names the cache and the environment variable that disables the library.
    """
    if os.environ.get(f'{package.upper()}_COMPILED') == '0':
        return None
    # only here and below: most programs that import this package load no library
    import subprocess

    try:
        return _load(package, source, flags)
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        reason = str(getattr(error, 'stderr', None) or error).strip()
        logging.getLogger(package).warning('%s: no C core: %s', consequence, reason)
        return None


def _load(package: str, source: Path, flags: Sequence[str]) -> ctypes.CDLL:
    """Load the shared library; build it if it is missing or damaged in the cache.

    Raises:
        OSError, ValueError, SubprocessError: It cannot be built or loaded.
    """
    import ctypes
    import hashlib
    import shlex
    import shutil

    compiler = shlex.split(os.environ.get('CC', ''))
    compiler = compiler or [each for each in ('cc', 'gcc') if shutil.which(each)][:1]
    if not compiler:
        raise OSError('there is no C compiler; install one (apt install gcc)')
    command = [*compiler, *FLAGS, *flags]
    program = Path(shutil.which(compiler[0]) or compiler[0]).resolve()
    status = program.stat()  # another one after an upgrade
    version = f'{program} {status.st_size} {status.st_mtime_ns}'
    key = (source.read_bytes(), *map(str.encode, (*command, version, _processor())))
    digest = hashlib.sha256(b'\0'.join(key)).hexdigest()
    cache = cache_folder(package)
    if cache is None:
        return _build(command, source)
    kept = cache / 'compiled' / f'{digest}.so'
    with contextlib.suppress(OSError):
        return ctypes.CDLL(str(kept))
    try:
        kept.parent.mkdir(parents=True, exist_ok=True)
        return _build(command, source, kept)
    except OSError:  # no room or no right there
        return _build(command, source)


def _build(command: Sequence[str], source: Path, kept: Path | None = None) -> ctypes.CDLL:
    """Build and load the library; with ``kept``, store it there atomically."""
    import ctypes
    import subprocess
    import tempfile

    place = None if kept is None else kept.parent
    with tempfile.TemporaryDirectory(prefix='compiled-', dir=place) as folder:
        made = Path(folder) / 'made.so'
        arguments = [*command, '-o', str(made), str(source), '-lm']
        subprocess.run(arguments, check=True, capture_output=True, text=True, timeout=BUILD_TIME)
        loaded = ctypes.CDLL(str(made))
        if kept is not None:
            with made.open('rb') as file:
                os.fsync(file.fileno())
            made.replace(kept)
        return loaded


def _processor() -> str:
    """Return the type of this processor: machines that share a home folder may differ."""
    try:
        lines = Path('/proc/cpuinfo').read_text(encoding='ascii', errors='replace').splitlines()
    except OSError:
        lines = []
    features = next((line for line in lines if line.startswith(('flags', 'Features'))), '')
    return f'{os.uname().machine} {features}'
