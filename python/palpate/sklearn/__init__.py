"""Estimators with scikit-learn's interface: readings are features; positions, forces or both are targets.

>>> import numpy as np
>>> import palpate.sklearn
>>> positions = np.linspace(0.0, 0.1, 30)
>>> readings = np.column_stack([np.cos(9 * positions), np.sin(9 * positions)])
>>> regressor = palpate.sklearn.GaussianProcessRegressor().fit(readings, positions)
>>> bool(abs(regressor.predict(readings[10:11]) - positions[10])[0] < 1e-3)
True
"""

from __future__ import annotations

from ._folds import PositionKFold
from ._regressors import (
    AutoRegressor,
    CentroidRegressor,
    ClosedFormRegressor,
    GaussianProcessRegressor,
    InfluenceRegressor,
    LevenbergMarquardtRegressor,
    NeighboursRegressor,
    NetworkRegressor,
)

__all__ = [
    "AutoRegressor",
    "CentroidRegressor",
    "ClosedFormRegressor",
    "GaussianProcessRegressor",
    "InfluenceRegressor",
    "LevenbergMarquardtRegressor",
    "NeighboursRegressor",
    "NetworkRegressor",
    "PositionKFold",
]
