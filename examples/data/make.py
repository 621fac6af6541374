"""Makes the sample data of this folder: simulated recordings with noise, hysteresis, creep and drift.

Run it with the Python package installed: python examples/data/make.py. Every run gives the same files.
"""

from pathlib import Path

import numpy as np
import palpate as pp

FOLDER = Path(__file__).parent

# A steel strip on two supports with six strain gauges under it, pressed through rubber.
strip = pp.Setup(
    pp.Beam("300 mm", "30 mm", "1.5 mm", "200 GPa"),
    pp.strain(6, noise="0.5 ue", gain_error="1 %", position_error="0.5 mm"),
).with_imperfections(
    pp.Imperfections(
        hysteresis="0.5 %",
        creep=[pp.Relaxation("0.3 %", "10 s"), pp.Relaxation("0.3 %", "5 min")],
        common_drift_per_hour="4 ue",
        walk_in_hour="2 ue",
        touch_width="3 mm",
    )
)

# A pad of silicone over twelve distance sensors.
skin = pp.Setup(
    pp.Plate("120 mm", "80 mm", "6 mm", "2 MPa", poissons_ratio=0.49, edges="clamped"),
    pp.deflection((4, 3), noise="5 um", gain_error="5 %", position_error="0.5 mm"),
).with_imperfections(
    pp.Imperfections(
        hysteresis="1 %",
        creep=pp.Relaxation("1 %", "5 s"),
        residue=pp.Relaxation("0.5 %", "30 s"),
        common_drift_per_hour="1 %",
        touch_width="8 mm",
        saturation="10 %",
    )
)


def write(name, about, recording, rows, channels, counts_per_unit):
    """Writes rows of a recording in counts of a converter, with an offset and a gain for each channel."""
    rng = np.random.default_rng(len(channels))
    offsets = rng.uniform(-800, 800, len(channels)).round()
    gains = counts_per_unit * rng.uniform(0.9, 1.1, len(channels))
    counts = np.rint(offsets + gains * recording.readings).astype(int)
    columns = {"time_s": (recording.time, 1), "x_mm": (1e3 * recording.x, 1)}
    if recording.positions.ndim == 2:
        columns["y_mm"] = (1e3 * recording.y, 1)
    columns["force_N"] = (recording.force, 2)
    with open(FOLDER / name, "w", encoding="utf-8", newline="\n") as file:
        print(f"# {about}; simulated with noise, drift and hysteresis by palpate {pp.__version__}", file=file)
        print(",".join([*columns, *channels]), file=file)
        for row in rows:
            fields = [f"{values[row]:.{digits}f}" for values, digits in columns.values()]
            print(",".join([*fields, *map(str, counts[row])]), file=file)


def calibration_and_use(setup, places, forces, touches, about, name, channels, counts_per_unit):
    """Writes presses at places, and touches on the same bench afterwards, each in a file of its own."""
    rng = np.random.default_rng(1)
    order = rng.permutation(len(places))
    touched = rng.uniform(np.min(places, axis=0), np.max(places, axis=0), (touches, *places.shape[1:]))
    force = np.concatenate([forces[order], rng.uniform(np.min(forces), np.max(forces), touches)])
    recording = setup.simulate_at(np.concatenate([places[order], touched]), force=force.round(2), seed=1)
    # An untouched row is before each press, and one at the end.
    pressed = 2 * len(places)
    rows = range(len(recording.readings))
    write(f"{name}-presses.csv", f"{about}, presses", recording, rows[:pressed], channels, counts_per_unit)
    write(f"{name}-touches.csv", f"{about}, touches", recording, rows[pressed:], channels, counts_per_unit)


def plane(xs, ys):
    return np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2)


calibration_and_use(
    strip,
    np.repeat(np.linspace(0.015, 0.285, 19), 2),
    np.tile([2.0, 5.0], 19),
    60,
    "Steel strip of 300 mm with six strain gauges",
    "strip",
    [f"gauge_{i}" for i in range(1, 7)],
    2e7,
)
grid = plane(np.linspace(0.008, 0.112, 9), np.linspace(0.008, 0.072, 6))
calibration_and_use(
    skin,
    grid,
    np.resize([0.5, 1.0, 2.0, 4.0], len(grid)),
    80,
    "Silicone skin of 120 × 80 mm with twelve sensors",
    "skin",
    [f"s{i}" for i in range(1, 13)],
    2e6,
)

plate = pp.Rig.load(str(FOLDER / "plate.toml"))
stroke = pp.simulate_moving(plate, seed=1)
stroke.to_csv(str(FOLDER / "stroke.csv"))
