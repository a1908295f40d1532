# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Many environments at once: several in each of a few processes, with numbers in shared memory.

Gymnasium's own gives each environment a process; more of them than cores wait for each other, and
every step of each costs two messages. Here a step of all costs two messages for each process.
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
from typing import Any, NamedTuple

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


class _Arrays(NamedTuple):
    """What all processes see; one row for each environment."""

    observations: Floats
    actions: Floats
    rewards: Floats
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]


_Memory = tuple[int, tuple[Any, ...]]
"""Number of environments, and the shared memory of each array."""


def _memory(count: int, observation: int, action: int) -> _Memory:
    sizes = (('f', observation), ('f', action), ('f', 1), ('b', 1), ('b', 1))
    return count, tuple(RawArray(kind, count * size) for kind, size in sizes)


def _arrays(memory: _Memory) -> _Arrays:
    """Return views of the memory."""
    count, parts = memory
    kinds = (np.float32, np.float32, np.float32, np.bool_, np.bool_)
    views: list[NDArray[Any]] = list(map(np.frombuffer, parts, kinds))
    return _Arrays(views[0].reshape(count, -1), views[1].reshape(count, -1), *views[2:])


class ProcessVectorEnv(VectorEnv[Floats, Floats, NDArray[Any]]):
    """Environments in processes; one that ends begins anew in the same step.

    The last observation and the infos of an episode
    that ended are in ``infos['final_obs']`` and ``infos['final_info']``.
    """

    def __init__(
        self, make: Callable[[], Env], num_envs: int, *, processes: int | None = None
    ) -> None:
        """Start the processes.

        Args:
            make: Makes an environment whose observations and actions are rows of numbers; a
                function that other processes can import.
            processes: In how many processes; as many as there are cores for None.

        Raises:
            SetupError: There are fewer environments than processes, or no rows of numbers.
            SimulationError: An environment cannot be made.
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
        memory = _memory(num_envs, math.prod(observed.shape), math.prod(acted.shape))
        self._arrays = _arrays(memory)
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
        """Begin an episode in all of them; seeds go up by one from the first, or are a list."""
        seeds = seed if isinstance(seed, list) else self._seeds(seed)
        for worker in self._workers:
            worker.order('reset', [seeds[index] for index in worker.indices], options)
        infos = self._infos(self._answers())
        return self._arrays.observations.copy(), infos

    def step(
        self, actions: Floats
    ) -> tuple[Floats, Floats, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Pass a step in all of them.

        Raises:
            SimulationError: One of them failed, or a process died.
        """
        arrays = self._arrays
        arrays.actions[:] = actions
        for worker in self._workers:
            worker.order('step')
        infos = self._infos(self._answers())
        return (
            arrays.observations.copy(),
            arrays.rewards.copy(),
            arrays.terminated.copy(),
            arrays.truncated.copy(),
            infos,
        )

    def call(self, name: str, *arguments: Any, **keywords: Any) -> tuple[Any, ...]:  # noqa: ANN401
        """Call a method of each of them; return what they return."""
        for worker in self._workers:
            worker.order('call', name, arguments, keywords)
        return tuple(answer for _, answer in self._answers())

    def close_extras(self, **_keywords: Any) -> None:  # noqa: ANN401
        """End the processes."""
        for worker in self._workers:
            worker.hang_up()
        for worker in self._workers:
            worker.join()

    def _seeds(self, seed: int | None) -> list[int | None]:
        return [None if seed is None else seed + index for index in range(self.num_envs)]

    def _answers(self) -> list[tuple[int, Any]]:
        """Wait for all processes; return index and answer of those environments that have one."""
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
    """Make many robots that are to walk, with keywords of :class:`.walking.WalkingEnv`."""
    return ProcessVectorEnv(partial(WalkingEnv, **keywords), num_envs)


Answer = list[tuple[int, Any]] | str


class _Worker:
    """A process as the one that started it sees it."""

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
        """Send a request; the answer is to be fetched."""
        try:
            self._pipe.send((order, arguments))
        except OSError as error:
            raise SimulationError(f'a process of environments has died: {error}') from error

    def answer(self) -> Answer:
        """Wait for the answer; it is text when something failed."""
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
    """Do what is asked for until the other end of the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the one that started it ends it
    batch = _Batch(_arrays(memory), indices)
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
    """The environments of a process."""

    def __init__(self, arrays: _Arrays, indices: range) -> None:
        self._arrays, self._indices = arrays, indices
        self.envs: list[Env] = []

    def step(self) -> Answer:
        answers, arrays = [], self._arrays
        for index, env in zip(self._indices, self.envs, strict=True):
            observation, reward, fallen, over, info = env.step(arrays.actions[index])
            if fallen or over:
                info = {'final_obs': observation, 'final_info': info}
                observation, begun = env.reset()
                info |= begun
            arrays.observations[index] = observation
            arrays.rewards[index] = reward
            arrays.terminated[index], arrays.truncated[index] = fallen, over
            if info:
                answers.append((index, info))
        return answers

    def reset(self, seeds: list[int | None], options: dict[str, Any] | None) -> Answer:
        answers = []
        for index, env, seed in zip(self._indices, self.envs, seeds, strict=True):
            self._arrays.observations[index], info = env.reset(seed=seed, options=options)
            answers.append((index, info))
        return answers

    def call(self, name: str, arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Answer:
        return [
            (index, env.get_wrapper_attr(name)(*arguments, **keywords))
            for index, env in zip(self._indices, self.envs, strict=True)
        ]
