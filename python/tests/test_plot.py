"""Pictures: every one on a line and on a plane, on given and on own axes, readable at a width of 80 mm, on light and dark grounds."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib import colors
from matplotlib.axes import Axes
from matplotlib.text import Text

import palpate as pp
import palpate.plot

plot = palpate.plot
WIDTH_80_MM = 80 / 25.4


class Bench:
    """What the pictures are of: a line and a plane, with presses and locators, each made once."""

    def __init__(self) -> None:
        beam = pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa")
        self.line = pp.Setup(beam, pp.deflection(8, noise="5 um"), force="3 N")
        self.unknown = self.line.with_force(None)
        supports = [pp.Support("0 mm", "clamped"), pp.Support("300 mm", "elastic", stiffness="2 kN/m")]
        held = pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa", supports=supports)
        self.mixed = pp.Setup(held, pp.deflection(4, noise="5 um"), pp.strain(["20 mm"], noise="1 ue"), pp.slope(["390 mm"], noise="1 mrad"))
        edges = {"left": "clamped", "right": "simple", "bottom": "simple", "top": "simple"}
        plate = pp.Plate("300 mm", "200 mm", "2 mm", "70 GPa", 0.33, edges=edges, elements=16)
        self.plane = pp.Setup(plate, pp.deflection((3, 3), noise="0.5 um"), force="5 N")
        self.digit = pp.Setup(pp.Digit("100 mm", "10 mm", "0.5 mm", "200 GPa"), pp.strain(3, noise="1 ue"))
        self.measured = pp.Setup(pp.Measured("100 mm"), pp.raw("p1", "p2"))
        self.one_sensor = pp.Setup(beam, pp.deflection(["150 mm"], noise="5 um"), force="3 N")
        self.presses = self.unknown.simulate(pp.even(10), force="3 N", repeats=3)
        self.locator = pp.Influence(source="recording").fit(self.presses)
        self.asked = self.unknown.simulate(pp.even(7), force="2 N", seed=4)
        self.known = pp.Influence().fit(self.line.simulate(pp.even(10), repeats=3))
        self.plane_presses = self.plane.simulate(pp.grid(6, 4), repeats=2, seed=1)
        self.plane_locator = pp.Influence().fit(self.plane_presses)
        self.plane_asked = self.plane.simulate(pp.grid(4, 3), seed=5)
        self.limits = {name: pp.limit(getattr(self, name)) for name in ("line", "plane", "one_sensor")}
        self.digit_limit = pp.limit(self.digit, force="1 N")
        several = self.line.simulate(pp.even(20), repeats=5, seed=2)
        self.held_out = pp.cross_validate(pp.Influence(), several)
        self.plane_held_out = pp.cross_validate(pp.Influence(), self.plane_presses)
        self.compared = pp.compare(several, only=["influence", "closed-form", "neighbours"])
        self.placed = pp.place_sensors(self.line, counts=(2, 6), sites="20 mm", method="refined", unknown_force=True)
        self.plane_placed = pp.place_sensors(self.plane, sites="50 mm", method="greedy-exchange")
        self.trained = pp.place_training(self.line, count=6, trials=2, calibrations=2, verify=2)
        self.plane_trained = pp.place_training(self.plane, count=6, trials=1, calibrations=1, verify=1, estimator=pp.Neighbours())
        self.advice = pp.next_press(self.line.simulate(pp.even(6, repeats=2)))
        motion = pp.Motion("50 mm", "350 mm", speed="1 m/s", passes=2, lifted="0.1 s")
        self.moving = pp.simulate_moving(self.unknown, motion, rate="100 Hz", density="7850 kg/m3", force="3 N")
        self.track = self.locator.track(self.moving)
        both = pp.Motion("50 mm", "150 mm", speed="0.3 m/s"), pp.Motion("350 mm", "250 mm", speed="0.3 m/s", lifted="0.1 s", passes=2)
        self.two = pp.simulate_moving(self.unknown, *both, rate="100 Hz", density="7850 kg/m3", force="3 N")
        self.two_tracked = pp.Influence(contacts=2).fit(self.presses).track(self.two)
        self.plane_moving = pp.simulate_moving(self.plane, pp.Motion(("50 mm", "40 mm"), ("250 mm", "160 mm"), speed="0.5 m/s"), rate="50 Hz")
        self.plane_track = self.plane_locator.track(self.plane_moving)
        self.loads = [pp.UniformLoad("100 mm", "160 mm", "4 N"), pp.UniformLoad("260 mm", "300 mm", "2 N")]
        self.profile = pp.load_profile(self.unknown, pp.simulate_loads(self.unknown, self.loads)[0])
        self.plane_load = pp.UniformLoad(("100 mm", "60 mm"), ("180 mm", "120 mm"), "20 N")
        self.plane_profile = pp.load_profile(self.plane, pp.simulate_loads(self.plane, self.plane_load)[0])
        self.networks = pp.Network(aggregate_error=0.01).of(self.line).fit_many(self.line.simulate(pp.even(10)), range(8))
        quick = pp.Study("paper").text.replace("max_epochs = 1_000_000", "max_epochs = 200")
        self.study = pp.Study.from_toml(quick).run(seeds=3, progress=False)


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench()


# Every picture, and whether it is of a plane.
PICTURES = {
    "setup: beam": lambda b, ax: plot.setup(b.line, ax=ax),
    "setup: beam without a force": lambda b, ax: plot.setup(b.unknown, ax=ax),
    "setup: other supports": lambda b, ax: plot.setup(b.mixed, force="3 N", ax=ax),
    "setup: plane": lambda b, ax: plot.setup(b.plane, ax=ax),
    "setup: digit": lambda b, ax: plot.setup(b.digit, force=1, ax=ax),
    "setup: measured": lambda b, ax: plot.setup(b.measured, ax=ax),
    "layouts: line": lambda b, ax: plot.layouts({"even": b.line, "mixed": b.mixed}, ax=ax),
    "layouts: plane": lambda b, ax: plot.layouts({"one": b.plane, "other": b.plane}, ax=ax),
    "arrangements: line": lambda b, ax: plot.arrangements(b.line, {"even": pp.even(10), "own": [0.1, 0.2]}, ax=ax),
    "arrangements: plane": lambda b, ax: plot.arrangements(b.plane, {"grid": pp.grid(4, 3), "own": [[0.1, 0.1]]}, ax=ax),
    "recording: line": lambda b, ax: plot.recording(b.presses, ax=ax),
    "recording: plane": lambda b, ax: plot.recording(b.plane_presses, ax=ax),
    "influence: setup": lambda b, ax: plot.influence(b.line, ax=ax),
    "influence: locator": lambda b, ax: plot.influence(b.locator, channels=[0, "deflection_4"], recording=b.presses, ax=ax),
    "influence: plane": lambda b, ax: plot.influence(b.plane, ax=ax),
    "influence: locator of a plane": lambda b, ax: plot.influence(b.plane_locator, channels=4, ax=ax),
    "contacts: line": lambda b, ax: plot.contacts(b.line, b.locator.locate(b.asked.readings), truth=b.asked, ax=ax),
    "contacts: force known": lambda b, ax: plot.contacts(b.known, b.known.locate(b.asked.readings), truth=b.asked, ax=ax),
    "contacts: plane": lambda b, ax: plot.contacts(b.plane, b.plane_locator.locate(b.plane_asked.readings), truth=b.plane_asked, ax=ax),
    "limit: line": lambda b, ax: plot.limit(b.limits["line"], setup=b.line, ax=ax),
    "limit: one sensor": lambda b, ax: plot.limit(b.limits["one_sensor"], ax=ax),
    "limit: digit": lambda b, ax: plot.limit(b.digit_limit, force="unknown", ax=ax),
    "limit: plane": lambda b, ax: plot.limit(b.limits["plane"], setup=b.plane, ax=ax),
    "lightest_touch: line": lambda b, ax: plot.lightest_touch(b.limits["line"], ax=ax),
    "lightest_touch: plane": lambda b, ax: plot.lightest_touch(b.limits["plane"], setup=b.plane, ax=ax),
    "force_limit: digit": lambda b, ax: plot.force_limit(b.digit_limit, setup=b.digit, ax=ax),
    "force_limit: plane": lambda b, ax: plot.force_limit(b.limits["plane"], ax=ax),
    "layouts: placement": lambda b, ax: plot.layouts(b.placed, ax=ax),
    "arrangements: placement": lambda b, ax: plot.arrangements(b.line, b.trained, ax=ax),
    "errors: line": lambda b, ax: plot.errors(b.held_out, limit=b.limits["line"], ax=ax),
    "errors: plane": lambda b, ax: plot.errors(b.plane_held_out, setup=b.plane, ax=ax),
    "predicted: line": lambda b, ax: plot.predicted(b.held_out, ax=ax),
    "predicted: plane": lambda b, ax: plot.predicted(b.plane_held_out, ax=ax),
    "error_histogram": lambda b, ax: plot.error_histogram({"ours": b.held_out, "neighbours": b.compared["neighbours"]}, ax=ax),
    "shares": lambda b, ax: plot.shares(b.compared, ax=ax),
    "comparison": lambda b, ax: plot.comparison(b.compared, ax=ax),
    "errors_along": lambda b, ax: plot.errors_along(b.compared, limit=b.limits["line"], ax=ax),
    "calibration: line": lambda b, ax: plot.calibration(b.locator.locate(b.asked.readings), b.asked, ax=ax),
    "calibration: plane": lambda b, ax: plot.calibration(b.plane_locator.locate(b.plane_asked.readings), b.plane_asked, ax=ax),
    "placement_curve": lambda b, ax: plot.placement_curve(b.placed, ax=ax),
    "placement_limit: line": lambda b, ax: plot.placement_limit(b.placed, ax=ax),
    "placement_limit: plane": lambda b, ax: plot.placement_limit(b.plane_placed, ax=ax),
    "training_errors: line": lambda b, ax: plot.training_errors(b.trained, method="optimal", ax=ax),
    "training_errors: plane": lambda b, ax: plot.training_errors(b.plane_trained, setup=b.plane, ax=ax),
    "next_press": lambda b, ax: plot.next_press(b.advice, ax=ax),
    "track: line": lambda b, ax: plot.track(b.track, truth=b.moving, ax=ax),
    "track: two contacts": lambda b, ax: plot.track(b.two_tracked, truth=b.two, ax=ax),
    "track: plane": lambda b, ax: plot.track(b.plane_track, truth=b.plane_moving, ax=ax),
    "track_errors: line": lambda b, ax: plot.track_errors(b.track, truth=b.moving, ax=ax),
    "track_errors: two contacts": lambda b, ax: plot.track_errors(b.two_tracked, truth=b.two, ax=ax),
    "track_errors: plane": lambda b, ax: plot.track_errors(b.plane_track, ax=ax),
    "speeds": lambda b, ax: plot.speeds({1.0: b.track, 0.3: b.two_tracked}, ax=ax),
    "load_profile: line": lambda b, ax: plot.load_profile(b.profile, loads=b.loads, setup=b.line, ax=ax),
    "load_profile: plane": lambda b, ax: plot.load_profile(b.plane_profile, loads=b.plane_load, setup=b.plane, ax=ax),
    "kernels": lambda b, ax: plot.kernels(b.profile, ax=ax),
    "kernel_widths: line": lambda b, ax: plot.kernel_widths(b.profile, setup=b.line, ax=ax),
    "kernel_widths: plane": lambda b, ax: plot.kernel_widths(b.plane_profile, ax=ax),
    "residuals: line": lambda b, ax: plot.residuals(b.profile, b.line, ax=ax),
    "residuals: plane": lambda b, ax: plot.residuals(b.plane_profile, b.plane, ax=ax),
    "convergence": lambda b, ax: plot.convergence({"eight": b.networks, "one": b.networks[0]}, ax=ax),
    "study: two arms": lambda b, ax: plot.study(b.study, ["position-10", "middle4-10"], ax=ax),
    "study: every arm": lambda b, ax: plot.study(b.study, ax=ax),
}
# Labels of what is counted, or has no unit.
WITHOUT_UNIT = {"contacts", "sensors", "sensor", "presses to come", "epochs", "reading", "share of a cell's load"}
every_picture = pytest.mark.parametrize("picture", PICTURES.values(), ids=PICTURES.keys())


@pytest.fixture(autouse=True)
def closed_figures():
    # Those that the examples of docstrings left open.
    plt.close("all")
    yield
    plt.close("all")


def texts(ax: Axes):
    """Every text of a picture that is seen, and the boxes that they take up."""
    figure = ax.figure
    found = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
    return [(text, text.get_window_extent()) for text in found if not is_hidden_tick(text, figure)]


def is_hidden_tick(text, figure) -> bool:
    """Ticks beyond the limits of an axis are made, and not drawn."""
    for axes in figure.findobj(Axes):
        for axis, limits, at in ((axes.xaxis, axes.get_xlim(), 0), (axes.yaxis, axes.get_ylim(), 1)):
            if text in axis.get_ticklabels(which="both") or text is axis.get_offset_text():
                low, high = sorted(limits)
                return not low - 1e-9 * (high - low) <= text.get_position()[at] <= high + 1e-9 * (high - low)
    return False


@every_picture
def test_given_axes_are_drawn_on_and_returned(picture, bench):
    figure, (left, right) = plt.subplots(1, 2)
    assert picture(bench, left) is left
    assert left.has_data() and not right.has_data()
    assert plt.get_fignums() == [figure.number]


@every_picture
@pytest.mark.filterwarnings("error")
def test_own_axes_are_of_a_figure_of_their_own(picture, bench):
    plt.figure()
    ax = picture(bench, None)
    assert len(plt.get_fignums()) == 2
    ax.figure.draw_without_rendering()
    labels = [label for axes in ax.figure.findobj(Axes) for label in (axes.get_xlabel(), axes.get_ylabel()) if label]
    assert labels and all(label in WITHOUT_UNIT or ", " in label for label in labels)


@every_picture
@pytest.mark.parametrize("style", ["default", "dark_background"])
@pytest.mark.filterwarnings("error")
def test_it_is_readable_at_80_mm_on_light_and_dark_grounds(picture, style, bench):
    with plt.style.context(style):
        figure, ax = plt.subplots(figsize=(WIDTH_80_MM, 0.8 * WIDTH_80_MM), layout="constrained")
        picture(bench, ax)
        # Matplotlib's layout settles with the second drawing where ticks change with the size of the axes.
        figure.draw_without_rendering()
        figure.draw_without_rendering()
        ground = luminance(figure.get_facecolor())
        for text, box in texts(ax):
            assert text.get_fontsize() >= 5.5, text
            assert contrast(luminance(text.get_color()), ground) > 3 or text.get_alpha(), text
            inside = figure.bbox.padded(1)
            assert inside.contains(box.x0, box.y0) and inside.contains(box.x1, box.y1), text
        legend = ax.get_legend()
        if legend is not None:
            assert not legend.get_window_extent().overlaps(ax.get_window_extent().padded(-1)), "the legend is over the data"
        assert ax.get_window_extent().width > 0.4 * figure.bbox.width
        if ax.get_aspect() == "auto":
            assert ax.get_window_extent().height > 0.25 * figure.bbox.height


def luminance(colour) -> float:
    """Relative luminance of a colour, as WCAG 2 has it; half-transparent ones as on a mid ground."""
    red, green, blue, alpha = colors.to_rgba(colour)
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (red, green, blue)]
    return float(np.dot(linear, (0.2126, 0.7152, 0.0722)) * alpha + 0.2 * (1 - alpha))


def contrast(one: float, other: float) -> float:
    return (max(one, other) + 0.05) / (min(one, other) + 0.05)


def test_series_have_the_colours_of_the_reports(bench):
    light = plot.limit(bench.limits["line"], ax=None)
    assert [line.get_color() for line in light.get_lines()[:2]] == ["#0072b2", "#d55e00"]
    with plt.style.context("dark_background"):
        dark = plot.limit(bench.limits["line"], ax=None)
        assert [line.get_color() for line in dark.get_lines()[:2]] == ["#4090d8", "#ff863d"]


def test_a_style_sheet_says_the_size_of_figures(bench):
    with plt.rc_context({"figure.figsize": (9, 9)}):
        assert plot.influence(bench.line).figure.get_figwidth() == 9


def test_numbers_are_in_the_units_of_the_labels(bench):
    ax = plot.influence(bench.line, channels="deflection_4")
    x, y = ax.get_lines()[0].get_data()
    at = int(np.argmin(np.abs(x - 200)))
    reading = bench.line.response([0.2])[0, 3]
    assert ax.get_ylabel() == "deflection_4, mm/N" and y[at] == pytest.approx(1e3 * reading, rel=1e-9)
    ax = plot.limit(bench.limits["line"], force="known")
    assert np.array_equal(ax.get_lines()[0].get_ydata(), 1e3 * bench.limits["line"].known_force)


def test_the_limit_beside_median_errors_is_a_median(bench):
    limit = bench.limits["line"]
    line = next(line for line in plot.errors_along(bench.compared, limit=limit).get_lines() if line.get_label() == "limit")
    errors = np.abs(np.random.default_rng(0).normal(size=100_000))
    assert line.get_ydata() == pytest.approx(1e3 * limit.sd * np.median(errors), rel=0.02)


def test_a_map_has_its_values_where_they_are(bench):
    limit = bench.limits["plane"]
    mesh = plot.limit(limit, setup=bench.plane).collections[0]
    cells = np.asarray(mesh.get_array()).reshape(mesh.get_coordinates().shape[0] - 1, -1)
    row, column = np.searchsorted(np.unique(limit.y), limit.y[17]), np.searchsorted(np.unique(limit.x), limit.x[17])
    assert cells[row, column] == 1e3 * limit.known_force[17]
    x, y = mesh.get_coordinates()[[0, -1], [0, -1]].T
    assert x.tolist() == pytest.approx([0, 300]) and y.tolist() == pytest.approx([0, 200])


def test_bands_are_of_what_presses_leave_open(bench):
    learnt = bench.locator.influence_functions()
    clean = bench.line.response(learnt.x)
    off = np.abs(learnt.values - clean)[8:-8] / learnt.sd[8:-8]
    assert np.mean(off < 1.96) > 0.9 and np.mean(off > 0.1) > 0.5
    ax = plot.influence(bench.locator, channels=3)
    band = ax.collections[0].get_paths()[0].vertices
    assert band[:, 1].min() < ax.get_lines()[0].get_ydata().min()


REFUSED = [
    (lambda b: plot.setup(b.plane, force=1), "a plane is drawn unbent"),
    (lambda b: plot.setup(b.line, at="500 mm"), "500 mm"),
    (lambda b: plot.layouts({}), "0 layouts"),
    (lambda b: plot.layouts({"one": b.line, "other": b.plane}), "different sizes"),
    (lambda b: plot.arrangements(b.plane, {"own": [0.1, 0.2]}), r"'own' have the shape \(2,\); it must be \(positions, 2\)"),
    (lambda b: plot.recording(b.presses, channels="p7"), "channel 'p7' does not exist; the channels are deflection_1"),
    (lambda b: plot.recording(b.presses, channels=8), "channel 8 does not exist; the channels are 0 to 7"),
    (lambda b: plot.recording(b.presses, channels=[]), "`channels` is empty"),
    (lambda b: plot.influence(b.mixed), "deflection and slope and strain, which share no axis"),
    (lambda b: plot.influence(b.plane, channels=[0, 1]), "on a plane a picture shows one"),
    (lambda b: plot.influence(b.measured), "no model"),
    (lambda b: plot.influence(pp.Network(max_epochs=1).fit(b.line.simulate(pp.even(4)))), "no influence functions"),
    (lambda b: plot.contacts(b.line, b.locator.locate(b.asked.readings), truth=b.presses), "30 rows and there are 7 estimates"),
    (lambda b: plot.contacts(b.plane, b.locator.locate(b.asked.readings)), "different surfaces"),
    (lambda b: plot.limit(b.limits["line"], setup=b.plane), "different surfaces"),
    (lambda b: plot.errors(b.held_out, limit=b.limits["plane"]), "limit and evaluation are of different surfaces"),
    (lambda b: plot.errors(b.held_out, tolerance="2 N"), "a force; it must be a length"),
    (lambda b: plot.errors(b.plane_held_out, setup=b.line), "evaluation and setup are of different surfaces"),
    (lambda b: plot.errors_along(b.plane_held_out), "`plot.errors` draws a map"),
    (lambda b: plot.shares({}), "0 evaluations"),
    (lambda b: plot.error_histogram(b.held_out, bins=0), "`bins` is 0; it must be at least 1"),
    (lambda b: plot.calibration(b.locator.locate(b.asked.readings), b.presses), "30 rows and there are 7 estimates"),
    (lambda b: plot.placement_curve(b.plane_placed), r"`place_sensors` with `counts=\(2, 12\)`"),
    (lambda b: plot.placement_limit(b.placed, method="best"), "layout 'best' does not exist; the layouts are"),
    (lambda b: plot.training_errors(b.trained, method="best"), "positions 'best' do not exist; the positions are"),
    (lambda b: plot.track(b.track, truth=b.two), "they must be of the same readings"),
    (lambda b: plot.track(b.track, setup=b.plane), "track and setup are of different surfaces"),
    (lambda b: plot.speeds({}), "0 tracks"),
    (lambda b: plot.speeds({1.0: b.locator.track(b.moving.time, b.moving.readings)}), "track a MovingRecording"),
    (lambda b: plot.load_profile(b.profile, loads=b.plane_load), "is of a plane, and the profile of a line"),
    (lambda b: plot.load_profile(b.plane_profile, loads=b.loads), "is of a line, and the profile of a plane"),
    (lambda b: plot.kernels(b.plane_profile), "`plot.kernel_widths`"),
    (lambda b: plot.kernels(b.profile, at=[2]), "from 0 to 1"),
    (lambda b: plot.residuals(b.profile, b.one_sensor), "8 channels and the setup has 1"),
    (lambda b: plot.convergence([]), "0 networks"),
    (lambda b: plot.convergence([b.locator]), "not trained by epochs"),
    (lambda b: plot.study(b.study, "none"), "names 'none'; the study has position-10"),
    (lambda b: plot.study(b.study, []), "names 0 arms"),
    (lambda b: plot.limit(b.limits["line"], force="maybe"), "'maybe'; it must be \"known\" or \"unknown\""),
]


@pytest.mark.parametrize("draw, words", REFUSED, ids=[words for _, words in REFUSED])
def test_bad_input_is_refused_in_words(draw, words, bench):
    with pytest.raises(pp.PalpateError, match=words):
        draw(bench)


@pytest.mark.parametrize(
    "draw",
    [
        lambda b: plot.setup(b.presses),
        lambda b: plot.setup(b.line, ax=plt.figure()),
        lambda b: plot.recording(b.line),
        lambda b: plot.influence(b.presses),
        lambda b: plot.contacts(b.line, b.locator.locate(b.asked.readings[0])),
        lambda b: plot.contacts(b.line, b.presses),
        lambda b: plot.limit(b.line),
        lambda b: plot.limit(b.limits["line"], setup=b.presses),
        lambda b: plot.errors(b.presses),
        lambda b: plot.shares({"one": b.presses}),
        lambda b: plot.comparison(b.held_out),
        lambda b: plot.placement_curve(b.line),
        lambda b: plot.training_errors(b.placed),
        lambda b: plot.next_press(b.trained),
        lambda b: plot.track(b.moving),
        lambda b: plot.track_errors(b.track, truth=b.presses),
        lambda b: plot.load_profile([b.profile]),
        lambda b: plot.load_profile(b.profile, loads=[1]),
        lambda b: plot.convergence([b.line]),
        lambda b: plot.study(b.line),
    ],
)
def test_what_is_of_another_type_is_refused_with_both_types(draw, bench):
    with pytest.raises(TypeError, match=r"must be|needed"):
        draw(bench)


def test_docstrings_run():
    for info in pkgutil.iter_modules(plot.__path__):
        module = importlib.import_module(f"palpate.plot.{info.name}")
        failures, _ = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
        assert failures == 0, module.__name__
        plt.close("all")


def test_every_picture_is_documented_and_drawn_here():
    drawn = {name.partition(":")[0] for name in PICTURES}
    assert drawn == set(plot.__all__)
    for name in plot.__all__:
        words = getattr(plot, name).__doc__
        assert all(part in words for part in ("Parameters", "Returns", "Examples", "ax : matplotlib.axes.Axes, optional")), name


def test_matplotlib_is_imported_with_the_pictures_alone():
    code = "import sys, palpate; assert 'matplotlib' not in sys.modules; import palpate.plot; assert 'matplotlib.pyplot' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
    code = "import sys; sys.modules['matplotlib'] = None\ntry: import palpate.plot\nexcept ImportError as error: print(error)"
    said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert said == "palpate.plot needs Matplotlib: pip install matplotlib\n"


def test_errors_are_those_of_the_evaluation_and_the_limit_its_mean_error(bench):
    by_position = bench.held_out.by_position()
    ax = plot.errors(bench.held_out, limit=bench.limits["line"])
    mean, largest, limit = ax.get_lines()[:3]
    assert np.array_equal(mean.get_ydata(), 1e3 * by_position.mean) and np.array_equal(largest.get_ydata(), 1e3 * by_position.max)
    summary = bench.limits["line"].summary["known_force"]
    assert np.mean(limit.get_ydata()) == pytest.approx(1e3 * summary["mean_error"], rel=1e-9)


def test_histograms_count_every_contact(bench):
    ax = plot.error_histogram(bench.held_out, bins=7, tolerance=None)
    outline = ax.patches[0].get_xy()
    heights, edges = np.histogram(1e3 * bench.held_out.error, 7)
    assert outline[:, 1].max() == heights.max() and outline[:, 0].max() == pytest.approx(edges[-1])


def test_shares_end_at_all_contacts(bench):
    error, share = plot.shares(bench.held_out).get_lines()[0].get_data()
    assert share[-1] == 100 and error[-1] == 1e3 * bench.held_out.summary()["max"]
    within = bench.held_out.effective_length(f"{error[40]} mm")
    assert share[40] == pytest.approx(100 * within, abs=1e-9)


@pytest.mark.parametrize("where", ["line", "plane"])
def test_regions_hold_as_many_contacts_as_they_say(bench, where):
    setup = bench.unknown if where == "line" else bench.plane
    locator = pp.Influence(source="mechanics").fit(
        setup.simulate(pp.even(10), force="3 N") if where == "line" else bench.plane_presses
    )
    asked = setup.simulate_at(np.linspace(0.1, 0.3, 400), force="3 N") if where == "line" else setup.simulate(pp.grid(20, 20))
    x, y = plot.calibration(locator.locate(asked.readings), asked).get_lines()[1].get_data()
    # Kolmogorov and Smirnov's bound of 400 values at 0.1 %, and room for what is not normal beside the edges of a plate.
    assert np.max(np.abs(np.asarray(y) - np.asarray(x))) < 100 * 1.95 / np.sqrt(400) + (0 if where == "line" else 15)


@pytest.mark.parametrize("where", ["line", "plane"])
def test_untouched_readings_have_no_region(bench, where):
    setup = bench.unknown if where == "line" else bench.plane
    locator = pp.Influence(source="mechanics").fit(
        setup.simulate(pp.even(10), force="3 N") if where == "line" else bench.plane_presses
    )
    touches = setup.simulate(pp.even(5) if where == "line" else pp.grid(3, 3), force="3 N")
    readings = np.concatenate([touches.readings, np.zeros((4, touches.readings.shape[1]))])
    estimates = locator.locate(readings)
    contacts = int(np.sum(estimates.status != "no_contact"))
    assert contacts <= len(touches) < len(estimates)
    regions = [one for one in plot.contacts(setup, estimates).collections if one.get_label() == "95 % region"]
    assert [len(one.get_paths()) for one in regions] == [contacts]


def test_tracks_are_held_beside_the_contact_that_they_are_of(bench):
    ax = plot.track_errors(bench.two_tracked, truth=bench.two)
    first, second = (line.get_ydata() for line in ax.get_lines()[1:3])
    settled = bench.two.time > 0.2
    assert np.nanmedian(np.abs(first[settled])) < 10 and np.nanmedian(np.abs(second[settled])) < 10
    crossed = importlib.import_module("palpate.plot._tracks")._is_crossed
    nan = np.nan
    tracked, truths = np.array([[1.0, 3.0, nan, 1.0], [2.0, 1.0, 2.0, nan]]), np.array([[1.1, 1.1, 1.9, nan], [2.1, 3.1, nan, 1.1]])
    assert crossed(tracked, truths).tolist() == [False, True, True, True]


def test_true_loads_hold_their_force(bench):
    x, density = plot.load_profile(bench.profile, loads=bench.loads).get_lines()[1].get_data()
    assert np.trapezoid(density, x) == pytest.approx(6) if hasattr(np, "trapezoid") else np.trapz(density, x) == pytest.approx(6)


def test_kernels_are_shares_about_their_place(bench):
    profile = bench.profile
    assert profile.kernels.shape == (len(profile), len(profile)) and profile.kernel_widths.shape == (len(profile),)
    assert np.median(profile.kernel_widths) == pytest.approx(profile.resolution)
    middle = len(profile) // 2
    assert abs(profile.x[np.argmax(profile.kernels[middle])] - profile.x[middle]) < 0.05
    ax = plot.kernels(profile, at=[0.5])
    assert np.array_equal(ax.get_lines()[0].get_ydata(), profile.kernels[middle])


def test_curves_of_convergence_end_at_the_share_that_converged(bench):
    few = pp.Network(aggregate_error=1e-9, max_epochs=20).of(bench.line).fit_many(bench.line.simulate(pp.even(10)), range(2))
    ax = plot.convergence({"all": bench.networks, "none": few})
    assert [line.get_ydata()[-1] for line in ax.get_lines()] == [100, 0]
