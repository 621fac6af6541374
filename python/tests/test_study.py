"""Studies: the same tables from threads, processes, Dask, MPI, Ray and shards, also where workers are lost."""

from __future__ import annotations

import importlib.util
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from conftest import missing

import palpate as pp

SMALL = """
name = "small"
[surface]
kind = "beam"
length = "400 mm"
width = "40 mm"
thickness = "1.2 mm"
youngs_modulus = "200 GPa"
[sensors]
measure = "deflection"
count = 4
noise = "5 um"
[contact]
force = "3 N"
[training]
count = 10
[evaluation]
from = "20 mm"
to = "380 mm"
step = "40 mm"
readings = 2
[[arm]]
name = "networks"
sensors = { measure = "deflection", count = 8 }
estimator = { kind = "network", max_epochs = 2_000 }
[[arm]]
name = "noisy-networks"
estimator = { kind = "network", max_epochs = 500 }
[[arm]]
name = "influence"
estimator = { kind = "influence" }
"""
SEEDS = 20
# Lasts long enough for a worker to be killed amid it.
LONG = SMALL.replace("max_epochs = 2_000", "max_epochs = 60_000, aggregate_error = 1e-6").replace("500", "15_000, aggregate_error = 1e-6")


@pytest.fixture(scope="module")
def study() -> pp.Study:
    return pp.Study.from_toml(SMALL)


@pytest.fixture(scope="module")
def long_study() -> pp.Study:
    return pp.Study.from_toml(LONG)


@pytest.fixture(scope="module")
def whole(study: pp.Study) -> pp.StudyResults:
    return study.run(SEEDS, threads=1)


@pytest.fixture(scope="module")
def long_whole(long_study: pp.Study) -> pp.StudyResults:
    return long_study.run(SEEDS)


def same(one: pp.StudyResults, other: pp.StudyResults) -> None:
    assert one.networks_csv == other.networks_csv
    assert one.evaluations_csv == other.evaluations_csv
    assert figures(one.to_dict()) == figures(other.to_dict())


def figures(results: dict) -> dict:
    """Results without the facts of the run, which are of the machine."""
    facts = ("threads", "arithmetic", "presentations", "seconds", "presentations_per_second", "shards")
    return {name: value for name, value in results.items() if name not in facts}


def test_the_command_writes_the_same_files(study, whole, command, tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)
    command("study", tmp_path / "small.toml", "--seeds", SEEDS, "--out", tmp_path / "out")
    assert (tmp_path / "out" / "networks.csv").read_text() == whole.networks_csv
    assert (tmp_path / "out" / "evaluations.csv").read_text() == whole.evaluations_csv
    written = json.loads((tmp_path / "out" / "results.json").read_text())
    assert figures(written) == figures(whole.to_dict())
    assert pp.Study(tmp_path / "small.toml") == study
    # What Python saves, the command goes on from, and has nothing left to fit.
    whole.save(tmp_path / "saved")
    command("study", tmp_path / "small.toml", "--seeds", SEEDS, "--out", tmp_path / "saved", "--resume")
    assert (tmp_path / "saved" / "networks.csv").read_text() == whole.networks_csv
    assert (tmp_path / "saved" / "report.html").exists()


def test_threads_processes_and_blocks_change_nothing(study, whole):
    same(study.run(SEEDS, threads=3), whole)
    same(study.run(SEEDS, executor=lambda: ProcessPoolExecutor(2), block=3), whole)
    with ThreadPoolExecutor(2) as executor:
        same(study.run(SEEDS, executor=executor, block=7, threads=2), whole)




def test_results_have_the_figures_of_every_arm(whole):
    assert whole.names == ["networks", "noisy-networks", "influence"]
    assert whole.error_percent.shape == (3, 3)
    frame = whole.fits()
    assert list(frame["arm"].value_counts()) == [SEEDS] * 3
    medians = [frame[frame["arm"] == arm]["error_percent"].median() for arm in whole.names]
    assert np.allclose(whole.error_percent[:, 0], medians, atol=1e-6)
    assert np.isnan(whole.coverage_percent[0]).all() and whole.coverage_percent[2, 0] > 80
    assert [len(arm["x"]) for arm in whole.by_position] == [10] * 3
    assert np.allclose(whole.by_position[0]["x"], np.arange(0.02, 0.4, 0.04))
    assert "median error [%]" in whole.to_frame() and "weights" in whole.fits(weights=True)


def test_progress_counts_fits(long_study):
    for executor in (None, ThreadPoolExecutor):
        told = []
        long_study.run(9, executor=executor, progress=lambda stage, done, total: told.append((stage, done, total)))
        assert told and {stage for stage, _, _ in told} <= {"fits", "rounds"}
    assert told[-1] == ("fits", 27.0, 27.0)


def test_lost_workers_lose_nothing(long_study, long_whole, tmp_path):
    class Pools:
        """Process pools, of the first of which a worker is killed when some fits are finished."""

        made = 0

        def __call__(self) -> Executor:
            self.made += 1
            pool = ProcessPoolExecutor(2)
            if self.made == 1:
                threading.Thread(target=kill_a_worker, args=(pool, tmp_path / "out" / "networks.csv")).start()
            return pool

    pools = Pools()
    results = long_study.run(SEEDS, executor=pools, block=2, folder=tmp_path / "out")
    assert pools.made == 2, "no worker was killed amid the work"
    same(results, long_whole)
    assert (tmp_path / "out" / "networks.csv").read_text() == long_whole.networks_csv


def kill_a_worker(pool: ProcessPoolExecutor, table: Path) -> None:
    while not table.exists() or table.read_text().count("\n") < 6:
        time.sleep(0.01)
    os.kill(next(iter(pool._processes)), signal.SIGKILL)


def test_an_executor_that_breaks_leaves_what_is_finished(long_study, long_whole, tmp_path):
    with ProcessPoolExecutor(2) as pool:
        threading.Thread(target=kill_a_worker, args=(pool, tmp_path / "networks.csv")).start()
        with pytest.raises(pp.PalpateError, match="lost its workers; what is finished is in .* resume=True"):
            long_study.run(SEEDS, executor=pool, block=2, folder=tmp_path)
    kept = (tmp_path / "networks.csv").read_text().count("\n") - 2
    assert 4 <= kept < 3 * SEEDS
    assert not (tmp_path / "results.json").exists()
    with pytest.raises(pp.PalpateError, match="networks.csv is of an earlier run; resume=True continues"):
        long_study.run(SEEDS, folder=tmp_path)
    same(long_study.run(SEEDS, folder=tmp_path, resume=True), long_whole)


def test_ctrl_c_keeps_what_is_finished(long_study, long_whole, tmp_path, heeds_ctrl_c):
    table = tmp_path / "networks.csv"

    def interrupt():
        while not table.exists() or table.read_text().count("\n") < 4:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        long_study.run(SEEDS, folder=tmp_path)
    thread.join()
    assert table.read_text().count("\n") < 2 + 3 * SEEDS
    same(long_study.run(SEEDS, folder=tmp_path, resume=True), long_whole)


def test_dask_loses_a_worker_and_nothing_else(long_study, long_whole, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, cluster.get_client() as client:
        pids = list(client.run(os.getpid).values())
        table, finished = tmp_path / "networks.csv", []

        def kill():
            while not table.exists() or table.read_text().count("\n") < 6:
                time.sleep(0.01)
            os.kill(pids[0], signal.SIGKILL)
            finished.append(table.read_text().count("\n") - 2)

        thread = threading.Thread(target=kill)
        thread.start()
        results = long_study.run(SEEDS, executor=client.get_executor(), block=2, folder=tmp_path)
        thread.join()
        assert pids[0] not in client.run(os.getpid).values()
    assert finished[0] < 3 * SEEDS
    same(results, long_whole)


def test_mpi_gives_the_same_tables(study, whole, tmp_path):
    launcher = shutil.which("mpiexec", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))
    if launcher is None or importlib.util.find_spec("mpi4py") is None:
        missing("mpi4py and mpiexec are not there")
    script = tmp_path / "study.py"
    script.write_text(
        "import sys\n"
        "from mpi4py.futures import MPIPoolExecutor\n"
        "import palpate as pp\n"
        "if __name__ == '__main__':\n"
        "    with MPIPoolExecutor() as executor:\n"
        f"        pp.Study(sys.argv[1]).run({SEEDS}, executor=executor, block=4, folder=sys.argv[2])\n"
    )
    (tmp_path / "small.toml").write_text(SMALL)
    called = [launcher, "-n", "3", sys.executable, "-m", "mpi4py.futures", str(script), str(tmp_path / "small.toml"), str(tmp_path / "out")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    subprocess.run(called, check=True, env=environment, timeout=120)
    assert (tmp_path / "out" / "networks.csv").read_text() == whole.networks_csv
    assert (tmp_path / "out" / "evaluations.csv").read_text() == whole.evaluations_csv
    assert json.loads((tmp_path / "out" / "results.json").read_text())["threads"] == 2


def test_ray_gives_the_same_tables(study, whole):
    ray = pytest.importorskip("ray")

    class RayExecutor:
        def submit(self, function, *arguments) -> Future:
            return ray.remote(function).remote(*arguments).future()

    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    try:
        same(study.run(SEEDS, executor=RayExecutor(), block=4), whole)
    finally:
        ray.shutdown()


def test_a_row_that_a_crash_cut_off_is_made_again(study, whole, tmp_path):
    whole.save(tmp_path)
    for name in ("networks.csv", "evaluations.csv"):
        table = tmp_path / name
        table.write_text(table.read_text()[:-20])
    with pytest.warns(UserWarning, match=r"the last line of .*\.csv is cut off; its fit is made again") as told:
        same(study.run(SEEDS, folder=tmp_path, resume=True), whole)
    assert len(told) == 2
    evaluations = tmp_path / "evaluations.csv"
    evaluations.write_text("".join(evaluations.read_text().splitlines(keepends=True)[:-3]))
    with pytest.warns(UserWarning, match="3 fits of networks.csv are not in evaluations.csv; they are made again"):
        same(study.run(SEEDS, folder=tmp_path, resume=True), whole)


def test_shards_of_the_command_are_joined(study, whole, command, tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)
    folders = [tmp_path / str(number) for number in (1, 2, 3)]
    for number, folder in enumerate(folders, 1):
        if number == 3:
            with pytest.raises(pp.PalpateError, match="1 of 3 shards is missing: 3"):
                study.merge(folders[:2])
        command("study", tmp_path / "small.toml", "--seeds", SEEDS, "--shard", f"{number}/3", "--out", folder)
    merged = study.merge(folders)
    same(merged, whole)
    # The facts of the run are those that the command tells of the same shards.
    command("study", tmp_path / "small.toml", "--merge", *folders, "--out", tmp_path / "merged")
    assert merged.results_json == (tmp_path / "merged" / "results.json").read_text()
    with pytest.raises(pp.PalpateError, match="shard 1/3 is there twice"):
        study.merge([*folders, folders[0]])
    (folders[0] / "shard.json").unlink()
    with pytest.raises(pp.PalpateError, match=r"shard.json is missing; `palpate study FILE --shard"):
        study.merge(folders)


def test_further_seeds_go_on_from_fewer(study, whole, tmp_path):
    study.run(6, folder=tmp_path)
    added = []
    results = study.run(SEEDS, folder=tmp_path, resume=True, progress=lambda stage, done, total: added.append(total))
    same(results, whole)
    same(study.run(SEEDS, folder=tmp_path, overwrite=True), whole)


def test_studies_are_values(study):
    again = pickle.loads(pickle.dumps(study))
    assert again == study and hash(again) == hash(study) and again.arms == study.arms
    assert repr(pp.Study("paper")) == "<Study: paper, 12 arms, 100 seeds>"
    assert pp.Study() != study and (study == 1) is False


def test_bad_input_is_refused(study, whole, tmp_path):
    with pytest.raises(pp.FileError, match=r"study:4:8: `kind` is `bean`, did you mean `beam`\?.*\n 4 \| kind = \"bean\"\n   \|        \^+"):
        pp.Study.from_toml(SMALL.replace('kind = "beam"', 'kind = "bean"'))
    with pytest.raises(FileNotFoundError):
        pp.Study(tmp_path / "none.toml")
    with pytest.raises(pp.PalpateError, match="`seeds` is 0; it must be from 1 to 1,000,000"):
        study.run(0)
    with pytest.raises(TypeError, match="`threads` is of the type str; it must be an int"):
        study.run(threads="two")
    with pytest.raises(pp.PalpateError, match="`folder` is None; `resume` and `overwrite` determine"):
        study.run(resume=True)
    with pytest.raises(pp.PalpateError, match="`resume` and `overwrite` are both True"):
        study.run(folder=tmp_path, resume=True, overwrite=True)
    whole.save(tmp_path)
    other = pp.Study.from_toml(SMALL.replace("3 N", "2 N"))
    with pytest.raises(pp.PalpateError, match="networks.csv: line 1 belongs to another run"):
        other.run(folder=tmp_path, resume=True)
    assert (tmp_path / "networks.csv").read_text() == whole.networks_csv
    with pytest.raises(pp.PalpateError, match="results.json is of an earlier run"):
        study.run(folder=tmp_path)
    table = tmp_path / "networks.csv"
    table.write_text(table.read_text().replace("influence,3,", "influence,x,"))
    with pytest.raises(pp.PalpateError, match="networks.csv: line .*: seed: `x` is not"):
        study.run(folder=tmp_path, resume=True)
