# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bodies cut into nearly convex pieces by CoACD, in a process of its own, and cached.

``python -m arm_model.scene.pieces BODY PIECES`` reads and writes numpy files: CoACD cannot be
interrupted, nor trusted with every mesh. The pieces of each body are cached in a file in
``arm_model/pieces``; the file of a body that was given up contains none.
"""

from __future__ import annotations

from collections.abc import Sequence
import contextlib
from dataclasses import dataclass
import hashlib
import logging
import os
from pathlib import Path
import resource
import subprocess
import sys
from tempfile import NamedTemporaryFile, TemporaryDirectory
import time

import numpy as np

from robot_primitives import cache_folder

from ..arrays import Array, Places

CPU_LIMIT = 20  # seconds of a processor for one body: those of arms take 0.2 to 9

TIME_LIMIT = 30.0
"""Wall-clock limit in [s] for all bodies of a process; the next start continues with the rest."""

MANY_TRIANGLES = 5000  # a body of more is remeshed first: CoACD's time grows with their number

MAX_PIECES = 16  # pieces of a body at most: each is one more shape to check

SETTINGS = {
    'threshold': 0.1,
    'max_convex_hull': MAX_PIECES,
    'preprocess_resolution': 20,
    'resolution': 500,
    'mcts_nodes': 10,
    'mcts_iterations': 20,
}
"""A finger of 17,330 triangles takes 4 s of CPU time. With 60 iterations and resolution 30 it
takes 11 s, a third of CoACD's defaults, and gives as many pieces for an L, a fork and a ring."""


FORMAT = 'v5'  # version of the files in the cache: part of their names, as is the time limit


@dataclass(slots=True)
class Stopwatch:
    """Time that a process has spent on cutting bodies, in [s]."""

    spent: float = 0.0


_watch = Stopwatch()


def cut(corners: Array, triangles: Places) -> Sequence[Array]:
    """Return the corners of each piece; nothing for a body that is open or too intricate.

    Logs once that cutting begins. Raises TimeoutError if the next start should try again.

    Args:
        corners: Corners of the body (n, 3), without duplicates.
        triangles: Indices of their corners (m, 3).
    """
    if not _closed(triangles):
        return ()
    content = corners.tobytes() + triangles.tobytes()
    kept = cache_file('pieces', hashlib.sha256(content).hexdigest())
    if kept is not None:
        # numpy and zipfile raise what they like for a file that is missing or damaged
        with contextlib.suppress(Exception):
            return _read(kept)
    log = logging.getLogger(__name__)
    if not _watch.spent:
        log.warning(
            'cutting meshes into convex pieces, %g s at most; kept for the next start', TIME_LIMIT
        )
    left, begin = TIME_LIMIT - _watch.spent, time.monotonic()
    if left <= 0.0:
        raise TimeoutError
    with TemporaryDirectory(prefix='arm_model-') as folder:
        body, pieces = Path(folder, 'body.npz'), Path(folder, 'pieces.npz')
        np.savez(body, corners=corners, triangles=triangles)
        command = [sys.executable, '-m', __name__, str(body), str(pieces)]
        try:
            subprocess.run(command, capture_output=True, check=True, timeout=left)
            found = _read(pieces)
        except subprocess.TimeoutExpired as error:
            if left < TIME_LIMIT:  # others took the rest of it
                raise TimeoutError from error
            log.warning(
                'a body of a mesh was not cut in %g s; it is checked as its hull. To try again, '
                'delete %s',
                TIME_LIMIT,
                kept,
            )
            found = ()
        except subprocess.SubprocessError:
            found = ()
        except (OSError, ValueError):
            return ()
        finally:
            _watch.spent += time.monotonic() - begin
    if kept is not None:
        with contextlib.suppress(OSError):  # such as a full disk: cut at the next start, too
            write_whole(kept, *found)
    return found


def cache_file(kind: str, digest: str) -> Path | None:
    """Return the cache file for shapes of a mesh content; None if the user has no home."""
    cache = cache_folder('arm_model')
    name = f'{digest}-{FORMAT}-{TIME_LIMIT:g}s.npz'
    return None if cache is None else cache / kind / name


def write_whole(path: Path, *arrays: Array, **named: object) -> None:
    """Write a cache file atomically, as several programs may start at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with NamedTemporaryFile(dir=path.parent, suffix='.tmp', delete=False) as file:
        unfinished = Path(file.name)
        try:
            np.savez(file, *arrays, **named)  # type: ignore[arg-type]
            file.flush()
            os.fsync(file.fileno())
            unfinished.replace(path)
        except OSError:
            unfinished.unlink(missing_ok=True)
            raise


def _read(path: Path) -> Sequence[Array]:
    with np.load(path) as stored:
        return [stored[name] for name in stored.files]


def _closed(triangles: Places) -> bool:
    """Return whether each edge belongs to two triangles with opposite directions."""
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    ways = {(start, end) for start, end in edges.tolist()}
    return len(ways) == len(edges) and all((end, start) in ways for start, end in ways)


def main(body: str, pieces: str) -> None:
    """Read a body and write its pieces."""
    import coacd  # which programs that load robots need not wait for

    resource.setrlimit(resource.RLIMIT_CPU, (CPU_LIMIT, CPU_LIMIT))
    coacd.set_log_level('error')
    with np.load(body) as stored:
        mesh = coacd.Mesh(stored['corners'], stored['triangles'])
        remesh = 'on' if len(stored['triangles']) > MANY_TRIANGLES else 'off'
    found = coacd.run_coacd(mesh, preprocess_mode=remesh, **SETTINGS)
    np.savez(pieces, *(corners for corners, _ in found))


if __name__ == '__main__':
    main(*sys.argv[1:])
