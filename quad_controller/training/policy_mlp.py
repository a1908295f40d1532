# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A small network in numpy: layers with ELU between them, trained with Adam."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]


class Mlp:
    """Fully connected layers; inputs are normalised by mean and deviation, which belong to it.

    Attributes:
        mean: Subtracted from the inputs.
        deviation: The inputs are divided by it.
        weights: One matrix for each layer, inputs by outputs.
        biases: One row for each layer.
    """

    def __init__(self, sizes: Sequence[int], random: np.random.Generator) -> None:
        """Start with random weights (He's initialisation).

        Args:
            sizes: Numbers of inputs, of hidden units of each layer, and of outputs.
            random: Where they come from.
        """
        self.mean: Floats = np.zeros(sizes[0], np.float32)
        self.deviation: Floats = np.ones(sizes[0], np.float32)
        self.weights: list[Floats] = [
            (random.standard_normal((a, b)) * np.sqrt(2.0 / a)).astype(np.float32)
            for a, b in pairwise(sizes)
        ]
        self.weights[-1] *= np.float32(0.1)
        self.biases: list[Floats] = [np.zeros(size, np.float32) for size in sizes[1:]]

    def __call__(self, inputs: Floats) -> Floats:
        """Return the outputs for rows of inputs."""
        return self.activations(inputs)[-1]

    def activations(self, inputs: Floats) -> list[Floats]:
        """Return the normalised inputs, and the values after each layer."""
        values: list[Floats] = [(inputs - self.mean) / self.deviation]
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            value: Floats = values[-1] @ weight + bias
            last = layer == len(self.weights) - 1
            values.append(value if last else elu(value))
        return values

    def gradients(self, inputs: Floats, wanted: Floats) -> tuple[float, list[Floats]]:
        """Return the mean squared error and its derivatives by weights and biases in turn."""
        values = self.activations(inputs)
        error: Floats = values[-1] - wanted
        slope: Floats = error * np.float32(2.0 / error.size)
        gradients: list[Floats] = []
        for layer in reversed(range(len(self.weights))):
            gradients[:0] = [values[layer].T @ slope, slope.sum(axis=0)]
            if layer:
                # the derivative of ELU by what it gave: 1 above zero, value + 1 below
                slope = (slope @ self.weights[layer].T) * np.minimum(values[layer] + 1.0, 1.0)
        return float((error**2).mean()), gradients

    @property
    def parameters(self) -> list[Floats]:
        """Weights and biases in turn, as :meth:`gradients` has them."""
        return [each for pair in zip(self.weights, self.biases, strict=True) for each in pair]


def elu(values: Floats) -> Floats:
    """Return the exponential linear unit of some values."""
    result: Floats = np.where(values > 0.0, values, np.expm1(np.minimum(values, 0.0)))
    return result


class Adam:
    """Moves parameters against their gradients (Kingma and Ba, 2015)."""

    def __init__(self, parameters: Sequence[Floats], rate: float = 1e-3) -> None:
        """Start at rest.

        Args:
            parameters: What to move, in place.
            rate: Step size.
        """
        self.rate = rate
        self._parameters = list(parameters)
        self._first = [np.zeros_like(each) for each in parameters]
        self._second = [np.zeros_like(each) for each in parameters]
        self._steps = 0

    def step(self, gradients: Sequence[Floats]) -> None:
        """Move them once."""
        self._steps += 1
        rate = self.rate * np.sqrt(1 - 0.999**self._steps) / (1 - 0.9**self._steps)
        moments = zip(self._parameters, self._first, self._second, gradients, strict=True)
        for parameter, first, second, gradient in moments:
            np.add(first, np.float32(0.1) * (gradient - first), out=first)
            np.add(second, np.float32(0.001) * (gradient**2 - second), out=second)
            change = np.float32(rate) * first / (np.sqrt(second) + np.float32(1e-8))
            np.subtract(parameter, change, out=parameter)


def fit(
    network: Mlp,
    inputs: Floats,
    wanted: Floats,
    *,
    epochs: int,
    random: np.random.Generator,
    batch: int = 512,
) -> float:
    """Train on rows of inputs and wanted outputs; return the error of the last epoch.

    Args:
        network: What to train; its normalisation is set from the inputs.
        inputs: One row for each example.
        wanted: What the network shall give for them.
        epochs: How often all examples are seen.
        random: Order of the examples.
        batch: Examples of one step.
    """
    optimiser = Adam(network.parameters, rate=2e-3)
    error = 0.0
    for epoch in range(epochs):
        optimiser.rate = 2e-3 * 0.5 * (1.0 + np.cos(np.pi * epoch / epochs)) + 1e-5
        order, errors = random.permutation(len(inputs)), []
        for start in range(0, len(order), batch):
            chosen = order[start : start + batch]
            loss, gradients = network.gradients(inputs[chosen], wanted[chosen])
            optimiser.step(gradients)
            errors.append(loss)
        error = float(np.mean(errors))
    return error
