"""scipy's QR with column pivoting on the first matrix of design.rs: CPU time on one core, condition number.

Run: OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python3 crates/palpate/benches/design_scipy.py   (needs numpy and scipy)
"""

import statistics
import time

import numpy
import scipy.linalg

SITES, SENSORS, ROUNDS = 100_000, 8, 5

places = (numpy.arange(SITES) + 1) / (SITES + 1)
modes = numpy.array([numpy.sin(k * numpy.pi * places) for k in range(1, SENSORS + 1)])
times = []
for _ in range(ROUNDS):
    start = time.process_time()
    _, pivots = scipy.linalg.qr(modes, pivoting=True, mode="r")
    times.append(time.process_time() - start)
condition = numpy.linalg.cond(modes[:, pivots[:SENSORS]])
print(f"scipy {scipy.__version__}: {statistics.median(times) * 1e3:.1f} ms, condition {condition:.4f}")
