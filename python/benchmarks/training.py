"""Training rate of the founding paper's 8–10–1 network beside FANN and JAX, in one run on one core.

python python/benchmarks/training.py

Each trainer makes the same presentations: 30 patterns, one after the other, with gradient descent after every pattern, in double precision. JAX trains
one network, and many side by side (`vmap`). palpate's rate is that of `cargo bench -p palpate --bench training`. Needs jax (pip) and libdoublefann
(Debian: libfann-dev).
"""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import re
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

# One core for each: before any library starts its threads.
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"

import jax
import jax.numpy as jnp
import numpy as np

PROJECT = Path(__file__).resolve().parents[2]
SIZES = (8, 10, 1)
PATTERNS = 30
ROUNDS = 5
LEARNING_RATE = 0.1
SIGMOID = 3
INCREMENTAL = 0

random = np.random.default_rng(0)
INPUTS = random.uniform(-1.0, 1.0, (PATTERNS, SIZES[0]))
OUTPUTS = random.uniform(0.1, 0.9, (PATTERNS, SIZES[2]))


def presentations_per_s(train: Callable[[int], object], epochs: int, networks: int = 1) -> float:
    """Median rate over the rounds, after one round of warm-up."""
    train(epochs)
    rates = []
    for _ in range(ROUNDS):
        start = time.process_time()
        train(epochs)
        rates.append(epochs * PATTERNS * networks / (time.process_time() - start))
    return statistics.median(rates)


def fann() -> float:
    name = ctypes.util.find_library("doublefann")
    if name is None:
        raise SystemExit("libdoublefann is missing: install libfann-dev")
    library = ctypes.CDLL(name)
    for function in (library.fann_create_standard_array, library.fann_read_train_from_file):
        function.restype = ctypes.c_void_p
    library.fann_train_epoch.restype = ctypes.c_float
    network = ctypes.c_void_p(library.fann_create_standard_array(len(SIZES), (ctypes.c_uint * len(SIZES))(*SIZES)))
    library.fann_set_activation_function_hidden(network, SIGMOID)
    library.fann_set_activation_function_output(network, SIGMOID)
    library.fann_set_training_algorithm(network, INCREMENTAL)
    library.fann_set_learning_rate(network, ctypes.c_float(LEARNING_RATE))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "patterns.data"
        rows = [f"{PATTERNS} {SIZES[0]} {SIZES[2]}"]
        for pattern in zip(INPUTS, OUTPUTS, strict=True):
            rows += [" ".join(map(repr, values.tolist())) for values in pattern]
        file.write_text("\n".join(rows) + "\n")
        data = ctypes.c_void_p(library.fann_read_train_from_file(str(file).encode()))

    def train(epochs: int) -> None:
        for _ in range(epochs):
            library.fann_train_epoch(network, data)

    return presentations_per_s(train, 2000)


def in_jax(networks: int) -> float:
    jax.config.update("jax_enable_x64", True)
    weights = [
        jnp.asarray(random.normal(0.0, 0.5, (networks, fan_out, fan_in + 1)))
        for fan_in, fan_out in zip(SIZES, SIZES[1:], strict=False)
    ]

    def output(weights, x):
        for layer in weights:
            x = jax.nn.sigmoid(layer[:, :-1] @ x + layer[:, -1])
        return x

    def step(weights, pattern):
        x, y = pattern
        gradients = jax.grad(lambda weights: 0.5 * jnp.sum((output(weights, x) - y) ** 2))(weights)
        return [layer - LEARNING_RATE * gradient for layer, gradient in zip(weights, gradients, strict=True)], None

    def epoch(_, weights):
        return jax.lax.scan(step, weights, (INPUTS, OUTPUTS))[0]

    epochs = 200 if networks == 1 else 50
    one = jax.vmap(lambda weights: jax.lax.fori_loop(0, epochs, epoch, weights))
    compiled = jax.jit(one)
    return presentations_per_s(lambda _: jax.block_until_ready(compiled(weights)), epochs, networks)


def palpate() -> list[tuple[str, float]]:
    """Rates one after the other, and side by side with the best instruction set."""
    bench = ["cargo", "bench", "-q", "-p", "palpate", "--bench", "training"]
    printed = subprocess.run(bench, cwd=PROJECT, capture_output=True, text=True, check=True).stdout
    block = printed.split(f"{PATTERNS} patterns, F64: ")[1].split("patterns")[0]
    rates = [float(rate) * 1e6 for rate in re.findall(r"([\d.]+) M/s", block)]
    return [("palpate, one network", rates[0]), ("palpate, side by side", max(rates[1:]))]


def main() -> None:
    rows = [("FANN, one network", fann()), ("JAX, one network", in_jax(1)), ("JAX, 256 networks", in_jax(256)), *palpate()]
    for name, rate in rows:
        print(f"{name:<22} {rate / 1e6:7.2f} M presentations/s")


if __name__ == "__main__":
    main()
