"""palpate's estimators beside scikit-learn's Gaussian process on real recordings, with times, in one run.

python python/benchmarks/recordings.py FOLDER

FOLDER has the recordings of two public sensors that the rigs examples/fsi-*.toml name. Every method is judged by scikit-learn's `cross_val_predict`
with `PositionKFold(5)`, which holds out whole positions. scikit-learn's process is what serves these recordings best there: proportions of the
readings and the logarithm of their size, standardized, a Matérn kernel of 5/2 with a length for each feature, and the noise fitted. It is not told the
forces and depths, which palpate's methods learn from the recording and do not know in use.
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from sklearn.model_selection import cross_val_predict
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler

import palpate as pp
from palpate import sklearn as own

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
RECORDINGS = {
    "fsi-water": "1d-water-1.5mm.csv",
    "fsi-oil": "1d-oil-1.0mm.csv",
    "fsi-air": "1d-air-2.0mm.csv",
    "fsi-sheet": "2d-sheet-part.csv",
}


def proportions(readings: np.ndarray) -> np.ndarray:
    size = np.linalg.norm(readings, axis=1, keepdims=True)
    return np.hstack([readings / size, np.log(size)])


def scikit_learns(channels: int) -> Pipeline:
    kernel = ConstantKernel(1.0, (1e-3, 1e4)) * Matern(np.ones(channels + 1), (1e-2, 1e3), nu=2.5)
    process = GaussianProcessRegressor(kernel + WhiteKernel(1e-3, (1e-8, 1.0)), normalize_y=True, random_state=0)
    return make_pipeline(FunctionTransformer(proportions), StandardScaler(), process)


def judged(name: str, method, recording: pp.Recording, params: dict | None) -> None:
    truth = recording.positions
    begun = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        found = cross_val_predict(method, recording.readings, truth, cv=own.PositionKFold(5), params=params)
    seconds = time.process_time() - begun
    errors = 1e3 * np.abs(found - truth) if truth.ndim == 1 else 1e3 * np.linalg.norm(found - truth, axis=1)
    figures = f"{np.median(errors):.3f} | {errors.mean():.3f} | {np.sqrt((errors**2).mean()):.3f}"
    print(f"| {name} | {figures} | {seconds:.1f} |", flush=True)


def main() -> None:
    folder = Path(sys.argv[1])
    print("| recording, method | median, mm | mean, mm | RMS, mm | five fits and predictions, s of CPU |\n|---|---|---|---|---|")
    for rig_name, file in RECORDINGS.items():
        rig = pp.Rig.load(EXAMPLES / f"{rig_name}.toml")
        recording = rig.setup.read_csv(next(folder.rglob(file)))
        judged(f"{rig_name}, scikit-learn", scikit_learns(len(rig.setup.channels)), recording, None)
        known = {"force": recording.force, "nuisance": recording.nuisance}
        known = {name: values for name, values in known.items() if values is not None and np.isfinite(values).all()}
        for kind in (own.InfluenceRegressor, own.GaussianProcessRegressor, own.NeighboursRegressor):
            judged(f"{rig_name}, palpate's {kind.__name__}", kind(setup=rig.setup), recording, known)


if __name__ == "__main__":
    main()
