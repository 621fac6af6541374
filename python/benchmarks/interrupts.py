"""Time from Ctrl-C to `KeyboardInterrupt` in everything that takes long.

python python/benchmarks/interrupts.py [WORD]

Each call is interrupted at several moments, in a process that does nothing else; WORD chooses those whose names have it. The longest and the median
time are printed, in milliseconds. A call that ended before the signal says so. The package that is measured is the one that `import palpate` finds:
install it by `pip install ./python` first, and let the machine be idle.
"""

from __future__ import annotations

import os
import signal
import statistics
import sys
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np

import palpate as pp

MOMENTS = (0.1, 0.25, 0.5, 0.9, 1.5, 2.5)

Call = Callable[[], object]


def milliseconds(call: Call, moment: float) -> float | None:
    """Time from a signal at `moment`, in seconds, to the interrupt; None of a call that has ended by then."""
    sent = []

    def interrupt() -> None:
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(moment, interrupt)
    try:
        timer.start()
        call()
        timer.cancel()
        timer.join()
        time.sleep(0.01)
        return None
    except KeyboardInterrupt:
        stopped = time.perf_counter()
        timer.join()
        return 1e3 * (stopped - sent[0])


def calls() -> Iterator[tuple[str, Call]]:
    """Everything that takes long, with sizes that take some seconds."""
    beam = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
    few, many = beam.simulate(pp.even(10), repeats=10), beam.simulate(pp.even(300), repeats=10)

    def plate_of(elements: int) -> pp.Setup:
        """A plate that is not solved yet: once it is, it stays so."""
        surface = pp.Plate("300 mm", "200 mm", "2 mm", "70 GPa", 0.33, edges="simple", elements=elements)
        return pp.Setup(surface, pp.deflection((4, 4), noise="0.1 um"), force="5 N")

    plate = plate_of(24)
    on_plate = plate.simulate(pp.grid(30, 20), repeats=5)
    measured = pp.Setup(pp.Measured("400 mm"), pp.raw(8))
    with_forces = measured.recording(many.readings, many.x, force=many.force * np.tile([1.0, 1.5, 2.0], 1000))

    yield "fit, Network", lambda: pp.Network(aggregate_error=1e-12, max_epochs=2_000_000_000).fit(few)
    yield "fit_many, Network", lambda: pp.Network(aggregate_error=1e-12, max_epochs=2_000_000).fit_many(few, range(100))
    yield "fit, LevenbergMarquardt", lambda: pp.LevenbergMarquardt().fit(many)
    yield "fit, GaussianProcess", lambda: pp.GaussianProcess().fit(many)
    yield "fit, Influence of a beam", lambda: pp.Influence().fit(beam.simulate(pp.even(300), repeats=100))
    yield "fit, Influence of a plate", lambda: pp.Influence().fit(on_plate)
    yield "fit, Influence of a fine plate", lambda: pp.Influence().fit(plate_of(128).recording(on_plate.readings, on_plate.x, on_plate.y, force=5.0))
    yield "fit, Influence of a measured surface", lambda: pp.Influence().fit(with_forces)
    yield "fit, Neighbours", lambda: pp.Neighbours().fit(beam.simulate(pp.even(300), repeats=100))
    yield "fit, ClosedForm", lambda: pp.ClosedForm().fit(beam.simulate(pp.even(300), repeats=100))
    yield "fit, Centroid", lambda: pp.Centroid().fit(beam.simulate(pp.even(300), repeats=100))
    yield "fit, Auto", lambda: pp.Auto().fit(many)

    yield "limit of a fine plate", lambda: pp.limit(plate_of(128))
    yield "limit, every 1 mm", lambda: pp.limit(plate, every="1 mm")
    yield "place_sensors", lambda: pp.place_sensors(beam, sites="0.5 mm", verify=50)
    yield "place_sensors on a fine plate", lambda: pp.place_sensors(plate_of(128))
    yield "place_training", lambda: pp.place_training(beam, count=10)
    yield "next_press", lambda: pp.next_press(plate.simulate(pp.grid(6, 5)))
    yield "compare", lambda: pp.compare(many)
    yield "cross_validate", lambda: pp.cross_validate(pp.GaussianProcess(), many)
    yield "study", lambda: pp.Study("paper").run(100)
    yield "simulate on a fine plate", lambda: plate_of(128).simulate(pp.grid(30, 20), repeats=10)
    yield "simulate on a plate of 256 elements", lambda: plate_of(256).simulate(pp.grid(30, 20), repeats=10)
    yield "simulate, 4 million readings", lambda: beam.simulate(pp.even(400), repeats=10_000)
    motion = pp.Motion("50 mm", "350 mm", speed="0.2 m/s", passes=20)
    yield "simulate_moving", lambda: pp.simulate_moving(beam, motion, rate="5 kHz", density="7850 kg/m3")
    locator = pp.Influence().fit(few)
    short = pp.Motion("50 mm", "350 mm", speed="0.2 m/s", passes=20)
    moving = pp.simulate_moving(beam, short, rate="1 kHz", density="7850 kg/m3")
    yield "track", lambda: locator.track(moving)
    yield "track, smoothed", lambda: locator.track(moving, smooth=True)
    readings = np.tile(many.readings, (1000, 1))
    yield "locate, 3 million readings", lambda: locator.locate(readings)
    of_plate = pp.Influence().fit(on_plate)
    yield "locate on a plate", lambda: of_plate.locate(np.tile(on_plate.readings, (100, 1)))
    again = on_plate[np.tile(np.arange(len(on_plate)), 100)]
    yield "evaluate", lambda: of_plate.evaluate(again)
    yield "tare, 300,000 readings", lambda: locator.tare(readings[:300_000])
    yield "load_profile", lambda: locator.load_profile(many.readings)
    patch = pp.UniformLoad(["50 mm", "50 mm"], ["100 mm", "80 mm"], "5 N")
    yield "simulate_loads on a fine plate", lambda: pp.simulate_loads(plate_of(128), patch, repeats=1000)


def main() -> None:
    # A shell's background ignores it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    word = sys.argv[1] if len(sys.argv) > 1 else ""
    print("| call | longest, ms | median, ms | interrupted |\n|---|---|---|---|")
    for name, call in calls():
        if word not in name:
            continue
        times = [milliseconds(call, moment) for moment in MOMENTS]
        late = [one for one in times if one is not None]
        figures = f"{max(late):.0f} | {statistics.median(late):.0f}" if late else "ended before | "
        print(f"| {name} | {figures} | {len(late)} of {len(times)} |", flush=True)


if __name__ == "__main__":
    main()
