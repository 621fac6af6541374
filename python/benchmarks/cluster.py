"""The founding paper's study on a Dask cluster of two workers, beside one worker, in one run; and its tables from everything else.

python python/benchmarks/cluster.py [SEEDS]

100 seeds of 12 arms where nothing is said. Every table is compared with the one of this process, byte by byte. The package that is measured is
the one that `import palpate` finds: install it by `pip install ./python` first, with distributed; mpi4py and ray where they are to be tried.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import distributed

import palpate as pp

MPI_SCRIPT = """
import sys
from mpi4py.futures import MPIPoolExecutor
import palpate as pp
if __name__ == "__main__":
    with MPIPoolExecutor() as executor:
        pp.Study("paper").run(int(sys.argv[1]), executor=executor, folder=sys.argv[2])
"""


class RayExecutor:
    def submit(self, function, *arguments):
        import ray

        return ray.remote(function).remote(*arguments).future()


class Bench:
    def __init__(self, seeds: int, folder: Path) -> None:
        self.seeds, self.folder = seeds, folder
        self.study = pp.Study("paper")
        self.whole, self.seconds = "", 0.0

    def told(self, name: str, run) -> float:
        begun = time.perf_counter()
        table = run()
        seconds = time.perf_counter() - begun
        self.whole = self.whole or table
        same = "the same table" if table == self.whole else "ANOTHER TABLE"
        print(f"{name}: {seconds:.1f} s, {same}", flush=True)
        return seconds

    def on_dask(self, workers: int, killed: bool = False) -> str:
        with distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster, cluster.get_client() as client:
            pids = list(client.run(os.getpid).values())
            out = self.folder / f"dask-{workers}-{killed}"
            if killed:
                threading.Thread(target=self.kill_half_way, args=(pids[0], out / "networks.csv")).start()
            return self.study.run(self.seeds, executor=client.get_executor(), folder=out, progress=False).networks_csv

    def kill_half_way(self, pid: int, table: Path) -> None:
        while not table.exists() or table.read_text().count("\n") < self.seeds * len(self.study.arms) / 2:
            time.sleep(0.05)
        os.kill(pid, signal.SIGKILL)
        print(f"worker {pid} killed with {table.read_text().count(chr(10)) - 2} fits finished", flush=True)

    def on_mpi(self, launcher: str) -> str:
        script, out = self.folder / "mpi.py", self.folder / "mpi"
        script.write_text(MPI_SCRIPT)
        run = [launcher, "-n", "3", sys.executable, "-m", "mpi4py.futures", str(script), str(self.seeds), str(out)]
        subprocess.run(run, check=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})
        return (out / "networks.csv").read_text()

    def on_ray(self) -> str:
        import ray

        ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
        try:
            return self.study.run(self.seeds, executor=RayExecutor(), progress=False).networks_csv
        finally:
            ray.shutdown()


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(seeds, Path(folder))
        bench.told("this process, 2 threads", lambda: bench.study.run(seeds, threads=2, progress=False).networks_csv)
        ratios = []
        for _ in range(3):
            one = bench.told("Dask, 1 worker", lambda: bench.on_dask(1))
            shutil.rmtree(bench.folder / "dask-1-False")
            two = bench.told("Dask, 2 workers", lambda: bench.on_dask(2))
            shutil.rmtree(bench.folder / "dask-2-False")
            ratios.append(one / two)
        print(f"two workers are {sorted(ratios)[1]:.2f} x as fast as one, the median of 3 ({min(ratios):.2f}-{max(ratios):.2f})")
        bench.told("Dask, 2 workers, one killed half-way", lambda: bench.on_dask(2, killed=True))
        pool = lambda: ProcessPoolExecutor(2)  # noqa: E731
        bench.told("process pool", lambda: bench.study.run(seeds, executor=pool, progress=False).networks_csv)
        launcher = shutil.which("mpiexec", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))
        if launcher is not None and importlib.util.find_spec("mpi4py") is not None:
            bench.told("MPI, 2 workers", lambda: bench.on_mpi(launcher))
        if importlib.util.find_spec("ray") is not None:
            bench.told("Ray", bench.on_ray)


if __name__ == "__main__":
    main()
