# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Vectorized environments: several in each of a few processes, data in shared memory.

Gymnasium's AsyncVectorEnv starts one process per environment: with more than there are cores, they
wait for each other, and each step costs two messages per environment. Here it is two per process.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
import math
import multiprocessing
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from multiprocessing.sharedctypes import RawArray
import os
import signal
from typing import Any

import gymnasium
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
import numpy as np
from numpy.typing import NDArray

from ..exceptions import SetupError, SimulationError
from .walking import Floats, WalkingEnv

Env = gymnasium.Env[Floats, Floats]
Seed = int | list[int | None] | None
JOIN_TIME = 5.0  # [s] until a process that was asked to end is ended


Rows = NDArray[np.void]
"""What all processes see; one row for each environment."""
_Memory = tuple[Any, np.dtype[np.void]]
"""Where it lies, and what a row has."""


def _row(observation: int, action: int) -> np.dtype[np.void]:
    """Return the data of a row, for given numbers of observations and actions."""
    numbers = [('observations', 'f4', (observation,)), ('actions', 'f4', (action,))]
    ends = [('rewards', 'f4'), ('terminated', '?'), ('truncated', '?')]
    return np.dtype([*numbers, *ends], align=True)


class ProcessVectorEnv(VectorEnv[Floats, Floats, NDArray[Any]]):
    """Environments in processes; a finished episode restarts in the same step.

    The final observation and infos of an episode are in ``infos['final_obs']`` and
    ``infos['final_info']``.
    """

    def __init__(
        self, make: Callable[[], Env], num_envs: int, *, processes: int | None = None
    ) -> None:
        """Start the processes.

        Args:
            make: Creates an environment whose observations and actions are rows of numbers; other
                processes must be able to import it.
            processes: Number of processes; None for the number of cores.

        Raises:
            SetupError: There are fewer environments than processes, or rows are not numeric.
            SimulationError: An environment cannot be created.
        """
        workers = min(len(os.sched_getaffinity(0)), num_envs) if processes is None else processes
        if not 1 <= workers <= num_envs:
            raise SetupError(
                f'{num_envs} environments in {workers} processes: give 1 or more each'
            )
        example = make()
        observed, acted = example.observation_space, example.action_space
        example.close()
        if not (isinstance(observed, spaces.Box) and isinstance(acted, spaces.Box)):
            raise SetupError('observations and actions must be rows of numbers')
        self.num_envs = num_envs
        self.metadata = {**example.metadata, 'autoreset_mode': AutoresetMode.SAME_STEP}
        self.single_observation_space, self.single_action_space = observed, acted
        self.observation_space = batch_space(observed, num_envs)
        self.action_space = batch_space(acted, num_envs)
        row = _row(math.prod(observed.shape), math.prod(acted.shape))
        memory = RawArray('b', num_envs * row.itemsize), row
        self._rows: Rows = np.frombuffer(*memory)
        ends = np.linspace(0, num_envs, workers + 1).round().astype(int).tolist()
        self._workers: list[_Worker] = []
        try:
            for first, last in pairwise(ends):
                self._workers.append(_Worker(make, memory, range(first, last)))
            self._answers()  # all are made
        except BaseException:
            self.close()
            raise

    def reset(
        self, *, seed: Seed = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Begin an episode in all environments; seeds count up from the first, or are a list."""
        if not isinstance(seed, list):
            seed = [None if seed is None else seed + index for index in range(self.num_envs)]
        for worker in self._workers:
            worker.order('reset', [seed[index] for index in worker.indices], options)
        infos = self._infos(self._answers())
        return self._rows['observations'].copy(), infos

    def step(
        self, actions: Floats
    ) -> tuple[Floats, Floats, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Advance all environments by one step.

        Raises:
            SimulationError: An environment failed, or a process died.
        """
        self._rows['actions'][:] = actions
        for worker in self._workers:
            worker.order('step')
        infos = self._infos(self._answers())
        names = 'observations', 'rewards', 'terminated', 'truncated'
        observations, rewards, fallen, over = (self._rows[name].copy() for name in names)
        return observations, rewards, fallen, over, infos

    def call(self, name: str, *arguments: Any, **keywords: Any) -> tuple[Any, ...]:  # noqa: ANN401
        """Call a method of each environment; return the results."""
        for worker in self._workers:
            worker.order('call', name, arguments, keywords)
        return tuple(answer for _, answer in self._answers())

    def close_extras(self, **_keywords: Any) -> None:  # noqa: ANN401
        """Stop the processes."""
        for worker in self._workers:
            worker.hang_up()
        for worker in self._workers:
            worker.join()

    def _answers(self) -> list[tuple[int, Any]]:
        """Wait for all processes; yield index and answer of environments that have one."""
        answers = [worker.answer() for worker in self._workers]
        for answer in answers:
            if isinstance(answer, str):
                raise SimulationError(answer)
        return [each for answer in answers if not isinstance(answer, str) for each in answer]

    def _infos(self, answers: Sequence[tuple[int, dict[str, Any]]]) -> dict[str, Any]:
        infos: dict[str, Any] = {}
        for index, info in answers:
            infos = self._add_info(infos, info, index)
        return infos


def walking_processes(num_envs: int = 1, **keywords: Any) -> ProcessVectorEnv:  # noqa: ANN401
    """Create vectorized walking environments, with keywords of :class:`.walking.WalkingEnv`."""
    return ProcessVectorEnv(partial(WalkingEnv, **keywords), num_envs)


Answer = list[tuple[int, Any]] | str


class _Worker:
    """Parent's handle of a worker process."""

    def __init__(self, make: Callable[[], Env], memory: _Memory, indices: range) -> None:
        # a process that is forked would have locks of threads that it does not have
        context = multiprocessing.get_context('spawn')
        self.indices = indices
        self._pipe, theirs = context.Pipe()
        self._process: SpawnProcess = context.Process(
            target=_serve, args=(theirs, make, memory, indices), daemon=True
        )
        self._process.start()
        theirs.close()

    def order(self, order: str, *arguments: object) -> None:
        """Send a request; :meth:`answer` returns the result."""
        try:
            self._pipe.send((order, arguments))
        except OSError as error:
            raise SimulationError(f'a process of environments has died: {error}') from error

    def answer(self) -> Answer:
        """Wait for the answer; on failure, it is an error text."""
        try:
            answer: Answer = self._pipe.recv()
        except (EOFError, OSError):
            self._process.join(JOIN_TIME)
            return f'a process of environments has died (exit code {self._process.exitcode})'
        return answer

    def hang_up(self) -> None:
        self._pipe.close()

    def join(self) -> None:
        self._process.join(JOIN_TIME)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


def _serve(pipe: Connection, make: Callable[[], Env], memory: _Memory, indices: range) -> None:
    """Serve requests until the other end of the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the one that started it ends it
    batch = _Batch(np.frombuffer(*memory), indices)
    try:
        batch.envs += [make() for _ in indices]
        pipe.send([])
        while True:
            order, arguments = pipe.recv()
            pipe.send(getattr(batch, order)(*arguments))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        pass
    except Exception as error:  # noqa: BLE001  # whatever it is, the other side has to know
        pipe.send(f'{type(error).__name__}: {error}')
    for env in batch.envs:
        env.close()


class _Batch:
    """The environments of one process."""

    def __init__(self, rows: Rows, indices: range) -> None:
        self._rows, self._indices = rows, indices
        self.envs: list[Env] = []

    def step(self) -> Answer:
        answers, rows = [], self._rows
        for index, env in zip(self._indices, self.envs, strict=True):
            observation, reward, fallen, over, info = env.step(rows['actions'][index])
            if fallen or over:
                info = {'final_obs': observation, 'final_info': info}
                observation, begun = env.reset()
                info |= begun
            rows['observations'][index], rows['rewards'][index] = observation, reward
            rows['terminated'][index], rows['truncated'][index] = fallen, over
            if info:
                answers.append((index, info))
        return answers

    def reset(self, seeds: list[int | None], options: dict[str, Any] | None) -> Answer:
        answers = []
        for index, env, seed in zip(self._indices, self.envs, seeds, strict=True):
            self._rows['observations'][index], info = env.reset(seed=seed, options=options)
            answers.append((index, info))
        return answers

    def call(self, name: str, arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Answer:
        return [
            (index, env.get_wrapper_attr(name)(*arguments, **keywords))
            for index, env in zip(self._indices, self.envs, strict=True)
        ]
