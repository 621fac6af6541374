"""palpate: turns an elastic surface with a few sensors into a calibrated contact locator.

>>> import palpate as pp
>>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"))
>>> presses = setup.simulate(pp.even(10), force="3 N", repeats=10, seed=0)
>>> locator = pp.Influence().fit(presses)
>>> estimates = locator.locate(presses.readings)
>>> bool(abs(estimates.x - presses.x)[40] < 1e-3)
True

Lengths are in metres, forces in newtons, moduli in pascals; a text with a unit may stand wherever such a number may: ``"400 mm"``.
"""

from __future__ import annotations

from ._design import (
    ContactPrior,
    KeepOut,
    Layout,
    MustHave,
    NextPress,
    SensorCounts,
    SensorOffer,
    SensorPlacement,
    TrainingPlacement,
    next_press,
    place_sensors,
    place_training,
)
from ._errors import FileError, PalpateError
from ._estimators import (
    Auto,
    Centroid,
    ClosedForm,
    DigitEstimator,
    GaussianProcess,
    Influence,
    LevenbergMarquardt,
    Neighbours,
    Network,
)
from ._evaluation import Comparison, ErrorsByPosition, compare, cross_validate
from ._imperfections import Imperfections, Relaxation
from ._influence import InfluenceFunctions
from ._inspect import Inspection, inspect
from ._limit import Limit, limit
from ._load_profile import LoadProfile, UniformLoad, load_profile, simulate_loads
from ._palpate import (
    Estimate,
    Estimates,
    Estimator,
    Evaluation,
    Locator,
    Recording,
    Rig,
    Setup,
    Tracker,
    Training,
    __version__,
    parse_quantity,
)
from ._sensors import Columns, Sensors, deflection, raw, reaction, slope, strain
from ._study import Study, StudyResults
from ._surfaces import Beam, BeamSection, Digit, Measured, Plate, Support
from ._tracking import ContactState, Motion, MovingRecording, Track, TrackedContact, TrackState, simulate_moving
from ._training import at, chebyshev, edge_dense, even, grid

__all__ = [
    "Auto",
    "Beam",
    "BeamSection",
    "Centroid",
    "ClosedForm",
    "Columns",
    "Comparison",
    "ContactPrior",
    "ContactState",
    "Digit",
    "DigitEstimator",
    "ErrorsByPosition",
    "Estimate",
    "Estimates",
    "Estimator",
    "Evaluation",
    "FileError",
    "GaussianProcess",
    "Imperfections",
    "Influence",
    "InfluenceFunctions",
    "Inspection",
    "KeepOut",
    "Layout",
    "LevenbergMarquardt",
    "Limit",
    "LoadProfile",
    "Locator",
    "Measured",
    "Motion",
    "MovingRecording",
    "MustHave",
    "Neighbours",
    "Network",
    "NextPress",
    "PalpateError",
    "Plate",
    "Recording",
    "Relaxation",
    "Rig",
    "SensorCounts",
    "SensorOffer",
    "SensorPlacement",
    "Sensors",
    "Setup",
    "Study",
    "StudyResults",
    "Support",
    "Track",
    "TrackState",
    "TrackedContact",
    "Tracker",
    "Training",
    "TrainingPlacement",
    "UniformLoad",
    "__version__",
    "at",
    "chebyshev",
    "compare",
    "cross_validate",
    "deflection",
    "edge_dense",
    "even",
    "grid",
    "inspect",
    "limit",
    "load_profile",
    "next_press",
    "parse_quantity",
    "place_sensors",
    "place_training",
    "raw",
    "reaction",
    "simulate_loads",
    "simulate_moving",
    "slope",
    "strain",
]
