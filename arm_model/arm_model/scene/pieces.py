# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bodies cut into nearly convex pieces by CoACD, in a process of its own.

``python -m arm_model.scene.pieces BODY PIECES`` reads and writes files of numpy: CoACD can neither
be stopped nor be trusted with every mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import logging
from pathlib import Path
import resource
import subprocess
import sys
from tempfile import TemporaryDirectory
import time

import numpy as np

from ..arrays import Array, Places

CPU_LIMIT = 20
"""Seconds of a processor for one body: those of arms take 0.2 to 9."""

TIME_LIMIT = 30.0
"""Seconds by the clock for all bodies of a process; the next start goes on with the others."""

MANY_TRIANGLES = 5000
"""A body of more is remeshed first: CoACD's time grows with their number."""

MAX_PIECES = 16
"""Pieces of a body at most: each is one more shape to check."""

SETTINGS = {
    'threshold': 0.1,
    'max_convex_hull': MAX_PIECES,
    'preprocess_resolution': 20,
    'resolution': 500,
    'mcts_nodes': 10,
    'mcts_iterations': 20,
}
"""A finger of 17,330 triangles takes 4 s of a processor. With 60 iterations and resolution 30 it
is 11 s, a third of the time of CoACD's defaults, for as many pieces of L, fork and ring."""


@dataclass(slots=True)
class Stopwatch:
    """How long a process has cut bodies, in [s]."""

    spent: float = 0.0


_watch = Stopwatch()


def cut(corners: Array, triangles: Places) -> Sequence[Array]:
    """Return the corners of each piece; nothing for a body that is open or too intricate.

    The log says once that it begins.

    Args:
        corners: Those of the body (n, 3), each once.
        triangles: Indices of their corners (m, 3).

    Raises:
        TimeoutError: `TIME_LIMIT` is over; the next start may do it.
    """
    if not _closed(triangles):
        return ()
    if not _watch.spent:
        logging.getLogger(__name__).warning(
            'cutting meshes into convex pieces, %g s at most; kept for the next start', TIME_LIMIT
        )
    left, begin = TIME_LIMIT - _watch.spent, time.monotonic()
    if left <= 0.0:
        raise TimeoutError
    with TemporaryDirectory(prefix='arm_model-') as folder:
        body, pieces = Path(folder, 'body.npz'), Path(folder, 'pieces.npz')
        np.savez(body, corners=corners, triangles=triangles)
        try:
            subprocess.run(
                [sys.executable, '-m', __name__, body, pieces],
                capture_output=True,
                check=True,
                timeout=left,
            )
            with np.load(pieces) as stored:
                return [stored[name] for name in stored.files]
        except subprocess.TimeoutExpired as error:
            raise TimeoutError from error
        except (OSError, ValueError, subprocess.SubprocessError):
            return ()
        finally:
            _watch.spent += time.monotonic() - begin


def _closed(triangles: Places) -> bool:
    """Return whether each edge belongs to two triangles, which pass it in opposite directions."""
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
