"""Sensors of a structure in every function: the same numbers as from the states by hand, in
physical coordinates; peaks against fine samples.
"""

import numpy as np
import pytest

import saltus as sl

MASS = np.diag([1.0, 2.0, 1.5])
STIFFNESS = 1e3 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.5, -1.5], [0.0, -1.5, 1.5]])
DAMPING = 4e-3 * STIFFNESS + 0.3 * MASS
STOP, GAP, DAMPER, FORCE, FREQUENCY = 5e3, 2e-3, 3.0, 2.0, 1.8
SHAPES = sl.structure_modes(MASS, STIFFNESS, 3)["shape"].values
MODES = [f"q{i}" for i in (1, 2, 3)]
SENSORS = {
    "tip": "x3",
    "tip speed": sl.velocity("x3"),
    "tip acceleration": sl.acceleration("x3"),
    "stop force": sl.contact_force("stop"),
    "stretch": ("x3", "x1"),
    "beyond": (lambda tip: sl.piecewise((tip - 1e-3, tip > 1e-3), otherwise=0), "m"),
}


def made(**options):
    about = {
        "contacts": [sl.Contact("x3", stiffness=STOP, gap=GAP, damping=DAMPER)],
        "forces": [sl.Force("x1", FORCE)], "frequency": FREQUENCY, "sensors": SENSORS,
    }  # fmt: skip
    return sl.structure(MASS, STIFFNESS, DAMPING, modes=3, **about | options)


STRUCTURE = made()


def by_hand(q, w, t, touching):
    """What the sensors show, from the coordinates of modes float64[..., 3] and their rates."""
    x, v = q @ SHAPES.T, w @ SHAPES.T
    stop = np.where(touching, STOP * (x[..., 2] - GAP) + DAMPER * v[..., 2], 0.0)
    load = -x @ STIFFNESS - v @ DAMPING
    load[..., 0] += FORCE * np.cos(2 * np.pi * FREQUENCY * np.asarray(t))
    load[..., 2] -= stop
    return {
        "tip": x[..., 2], "tip speed": v[..., 2], "tip acceleration": load[..., 2] / MASS[2, 2],
        "stop force": stop, "stretch": x[..., 2] - x[..., 0],
        "beyond": np.maximum(x[..., 2] - 1e-3, 0.0),
    }  # fmt: skip


def coordinates(ds, text="{}"):
    rates = [f"{name}_rate" for name in MODES]
    return (np.stack([ds[text.format(one)].values for one in names], axis=-1)
        for names in (MODES, rates))  # fmt: skip


def compare(ds, expected, text="{}"):
    for name, values in expected.items():
        found = ds[text.format(name)].values
        scale = np.abs(values).max(initial=1e-12)
        np.testing.assert_allclose(found, values, rtol=0, atol=1e-11 * scale, err_msg=name)


@pytest.fixture(scope="module")
def run():
    return sl.simulate(STRUCTURE, periods=300, keep=30, progress=False)


def test_samples_contacts_and_the_end(run):
    q, w = coordinates(run)
    compare(run, by_hand(q, w, run["time"].values, run["mode"].values & 1))
    assert run.sizes["contact"] > 30
    for text, mode in (("contact_{}", "after"), ("contact_{}_before", "before")):
        q, w = coordinates(run, "contact_{}")  # no state jumps at a spring
        touching = run[f"contact_mode_{mode}"].values & 1
        expected = by_hand(q, w, run["contact_time"].values, touching)
        expected.pop("beyond")
        compare(run, expected, text)
    q, w = coordinates(run, "end_{}")
    touching = (q @ SHAPES[2]) > GAP
    compare(run, by_hand(q, w, run["end_time"].values, touching), "end_{}")


def test_a_batch_over_a_parameter_and_the_stroboscope():
    gaps = [1e-3, 2e-3, 4e-3]
    points = sl.stroboscope(STRUCTURE, periods=20, values={"stop_gap": gaps}, progress=False)
    q, w = coordinates(points)
    tip = q @ SHAPES[2]
    np.testing.assert_allclose(points["tip"], tip, rtol=0, atol=1e-16)
    for row, gap in enumerate(gaps):
        depth = tip[row] - gap
        force = np.where(depth > 0, STOP * depth + DAMPER * (w[row] @ SHAPES[2]), 0.0)
        np.testing.assert_allclose(points["stop force"].values[row], force, rtol=0, atol=1e-12)


def test_settled_and_spectrum_see_outputs_as_states(run):
    found, last = sl.settled(run), run.isel(time=slice(None, -1))
    assert int(found["response_period"]) == 1
    for name in SENSORS:
        values = last[name].values
        assert float(found[f"{name}_peak"]) == pytest.approx(np.abs(values).max(), rel=1e-5)
        assert float(found[f"{name}_rms"]) == pytest.approx(np.sqrt(np.mean(values**2)), rel=1e-5)
    lines = sl.spectrum(run)
    combined = sum(
        SHAPES[2, i] * lines[f"{name}_amplitude"].values
        * np.exp(1j * lines[f"{name}_phase"].values) for i, name in enumerate(MODES)
    )  # fmt: skip
    np.testing.assert_allclose(lines["tip_amplitude"].values[1:], np.abs(combined)[1:], atol=1e-15)
    # a speed's line is that of the deflection times its angular frequency
    turn = 2 * np.pi * lines["frequency"].values[1:4]
    np.testing.assert_allclose(
        lines["tip speed_amplitude"].values[1:4], turn * lines["tip_amplitude"].values[1:4],
        rtol=1e-4,
    )  # fmt: skip
    alone = sl.spectrum(run, "stop force")
    assert [name for name in alone.data_vars if name.endswith("_amplitude")] == [
        "stop force_amplitude"
    ]


@pytest.mark.parametrize("surface", [("tip", "0.5 mm"), ("stop force", 3.0), "tip turns",
    "stretch turns", "tip acceleration turns", lambda tip, stretch: tip + stretch])  # fmt: skip
def test_a_section_at_an_output(surface):
    section = sl.poincare(STRUCTURE, None, surface, periods=10, transient=5, progress=False)
    assert section.sizes["crossing"] >= 10
    q, w = coordinates(section)
    time = section["crossing_time"].values
    touching = (q @ SHAPES[2]) > GAP
    found = by_hand(q, w, time, touching)
    mine = np.abs(q @ SHAPES[2] - GAP) > 1e-9  # on the boundary itself either side is right
    for name, values in found.items():
        np.testing.assert_allclose(section[name].values[mine], values[mine], atol=1e-9)
    if surface == ("tip", "0.5 mm"):
        np.testing.assert_allclose(section["tip"], 5e-4, rtol=1e-12)
    elif surface == ("stop force", 3.0):
        np.testing.assert_allclose(section["stop force"], 3.0, rtol=1e-10)
    elif surface == "tip turns":
        np.testing.assert_allclose(found["tip speed"], 0.0, atol=1e-14)
    elif surface == "stretch turns":
        np.testing.assert_allclose(w @ (SHAPES[2] - SHAPES[0]), 0.0, atol=1e-14)
    elif callable(surface):
        np.testing.assert_allclose(found["tip"] + found["stretch"], 0.0, atol=1e-15)


# -- numbers of responses --------------------------------------------------------------------------
def samples_of(structure, start, samples=8000):
    """A period of a settled motion, finely sampled."""
    return sl.simulate(structure, start, periods=1, samples=samples, progress=False)


def check_numbers(numbers, fine, harmonic=True):
    """Peaks lie above fine samples by less than neighbours differ; means are those of samples."""
    for name in SENSORS:
        values = fine[name].values[:-1]
        found = {key: float(one) for key, one in numbers(name).items()}
        step = np.abs(np.diff(fine[name].values)).max()
        if name == "tip acceleration":  # it jumps at contacts, by the damper's force
            step = np.sort(np.abs(np.diff(fine[name].values)))[-9]
        jump = 2 * DAMPER * np.abs(fine["tip speed"].values).max() / MASS[2, 2]
        slack = step + jump * (name in ("tip acceleration", "stop force"))
        assert 0 <= found["maximum"] - values.max() + 1e-12 <= slack, name
        assert 0 <= values.min() - found["minimum"] + 1e-12 <= slack, name
        scale = np.abs(values).max()
        assert found["mean"] == pytest.approx(values.mean(), abs=1e-3 * scale), name
        assert found["rms"] == pytest.approx(np.sqrt(np.mean(values**2)), rel=1e-3), name
        if harmonic:
            turn = np.exp(-2j * np.pi * np.arange(len(values)) / len(values))
            assert found["amplitude"] == pytest.approx(
                2 * abs(np.mean(values * turn)), abs=1e-3 * scale
            ), name


def test_attractors_tell_the_numbers_of_outputs():
    found = sl.attractors(STRUCTURE, np.zeros(6), progress=False)
    assert found["attractor_type"].values.tolist() == ["periodic"]
    start = [float(found[f"attractor_{name}"][0, 0]) for name in STRUCTURE.states]
    fine = samples_of(STRUCTURE, start)

    def numbers(name):
        one = found.sel(output=name).isel(attractor=0)
        keys = ("maximum", "minimum", "mean", "rms", "amplitude")
        return {key: one[f"attractor_output_{key}"] for key in keys}

    check_numbers(numbers, fine)
    first = float(found["attractor_peak"][0])
    assert float(found["attractor_output_peak"].sel(output="q1")[0]) == first
    assert "peak |tip|" in sl.describe(found)


def test_responses_and_branches_tell_the_numbers_of_outputs():
    more = {"twice the tip": (lambda tip: 2 * tip, "m")}
    responses = sl.frequency_response(
        STRUCTURE, frequency=[1.7, FREQUENCY, 1.9], outputs=more, progress=False
    )
    place = int(np.argmin(np.abs(responses["response_frequency"].values - FREQUENCY)))
    start = [float(responses[f"response_{name}"][place, 0]) for name in STRUCTURE.states]
    fine = samples_of(STRUCTURE, start)
    keys = ("maximum", "minimum", "mean", "rms", "amplitude")
    one = responses.isel(response=place)
    check_numbers(lambda name: {k: one[f"output_{k}"].sel(output=name) for k in keys}, fine)
    peak = responses["output_peak"]
    np.testing.assert_allclose(peak.sel(output="twice the tip"), 2 * peak.sel(output="tip"))
    force = sl.transmissibility(responses, "stop force", to="tip acceleration", by="rms")
    rms = responses["output_rms"]
    np.testing.assert_allclose(
        force["transmissibility"], rms.sel(output="stop force") / rms.sel(output="tip acceleration")
    )
    assert force["transmissibility"].attrs["units"] == "N/(m/s^2)"
    branches = sl.branches(STRUCTURE, {"frequency": (1.75, 1.85)}, progress=False)
    near = int(np.argmin(np.abs(branches["point_frequency"].values - FREQUENCY)))
    at = float(branches["point_frequency"][near])
    start = [float(branches[f"point_{name}"][near, 0]) for name in STRUCTURE.states]
    fine = samples_of(STRUCTURE.with_values(frequency=at), start)
    one = branches.isel(point=near)
    check_numbers(lambda name: {k: one[f"point_output_{k}"].sel(output=name) for k in keys}, fine)


@pytest.mark.parametrize("sample", ["turning_points", "stroboscope", "contacts"])
def test_a_bifurcation_diagram_samples_outputs(sample):
    diagram = sl.bifurcation_diagram(
        STRUCTURE, {"stop_gap": (1.5e-3, 2.5e-3, 3)}, sample=sample, progress=False
    )
    q, w = coordinates(diagram, "sample_{}")
    np.testing.assert_allclose(diagram["sample_tip"], q @ SHAPES[2], rtol=0, atol=1e-15)
    np.testing.assert_allclose(diagram["sample_tip speed"], w @ SHAPES[2], rtol=0, atol=1e-14)
    speed = diagram["sample_tip speed"].values
    there = np.isfinite(speed)
    assert there.any()
    if sample == "turning_points":  # those of the first sensor
        assert np.abs(speed[there]).max() < 1e-13
    if sample == "contacts":
        gap = np.repeat(diagram["response_stop_gap"].values, there.sum(axis=1))
        np.testing.assert_allclose(diagram["sample_tip"].values[there], gap, rtol=1e-12)


def test_impacts_take_the_force_of_a_sensor():
    options = {"periods": 20, "transient": 20, "progress": False}

    def force(stop_stiffness, stop_gap, stop_damping, q1, q2, q3, q1_rate, q2_rate, q3_rate):
        tip = SHAPES[2] @ np.array([q1, q2, q3])
        return stop_stiffness * (tip - stop_gap) + stop_damping * (
            SHAPES[2] @ np.array([q1_rate, q2_rate, q3_rate])
        )

    found = sl.impact_statistics(STRUCTURE, force={"stop": "stop force"}, **options)
    known = sl.impact_statistics(STRUCTURE, force={"stop": force}, **options)
    np.testing.assert_allclose(found["contact_impulse"], known["contact_impulse"], rtol=1e-9)
    np.testing.assert_allclose(found["touchdown_tip"], GAP, rtol=1e-12)
    np.testing.assert_allclose(found["touchdown_tip speed"], found["contact_speed"], rtol=1e-12)


def test_a_run_gives_outputs_at_given_times_and_ends_at_one():
    plain = sl.simulate(STRUCTURE, periods=10, samples=50, progress=False)
    times = plain["time"].values[[30, 7, 400]]
    some = sl.simulate(STRUCTURE, at=times, progress=False)
    q, w = coordinates(some)
    compare(some, by_hand(q, w, times, (q @ SHAPES[2]) > GAP))
    ended = sl.simulate(STRUCTURE, t_end=10, until="tip > 2.5 mm", progress=False)
    assert ended["status"].item() == "until"
    assert float(ended["end_tip"]) == pytest.approx(2.5e-3, rel=1e-10)
    assert float(ended["tip"].max()) <= 2.5e-3 + 1e-12


@pytest.mark.parametrize("state", [None, "tip", "stretch"])
@pytest.mark.slow
def test_a_backbone_tells_the_numbers_of_outputs(state):
    free = sl.structure(
        MASS, STIFFNESS, modes=3, contacts=[sl.Contact("x3", stiffness=STOP, gap=GAP)],
        sensors={name: SENSORS[name] for name in SENSORS if name != "beyond"},
    )  # fmt: skip
    spine = sl.backbone(free, (1e-3, 4e-3), state=state, progress=False)
    ends = spine["point_output_peak"].sel(output=state or "q1").values[[0, -1]]
    np.testing.assert_allclose(ends, [1e-3, 4e-3], rtol=1e-9)
    rows = [0, spine.sizes["point"] // 2, -1]
    for row in rows:
        point = spine.isel(point=row)
        start = [float(point[f"point_{name}"]) for name in free.states]
        run = sl.simulate(free, start, t_end=float(point["point_period"]), progress=False)
        for name in ("tip", "stop force", "tip acceleration"):
            values = np.abs(run[name].values)
            peak = float(point["point_output_peak"].sel(output=name))
            step = np.abs(np.diff(run[name].values)).max()
            assert 0 <= peak - values.max() + 1e-9 * peak <= step + 1e-9 * peak, name


def test_an_absolute_acceleration_has_that_of_the_base():
    base = sl.Base([1.0, 1.0, 1.0], 3.0)
    shaken = made(forces=(), base=base, contacts=(), sensors={"tip": sl.acceleration("x3"),
        "between": sl.acceleration("x3", to="x1")})  # fmt: skip
    run = sl.simulate(shaken, periods=5, progress=False)
    q, w = coordinates(run)
    x, v = q @ SHAPES.T, w @ SHAPES.T
    absolute = (-x @ STIFFNESS - v @ DAMPING) / np.diag(MASS)  # Newton: forces over masses
    np.testing.assert_allclose(run["tip"], absolute[:, 2], atol=1e-12 * np.abs(absolute).max())
    np.testing.assert_allclose(run["between"], absolute[:, 2] - absolute[:, 0], atol=1e-11)


def test_a_structure_without_modes_has_the_same_sensors():
    whole = sl.structure(
        MASS, STIFFNESS, DAMPING, frequency=FREQUENCY, sensors=SENSORS,
        contacts=[sl.Contact("x3", stiffness=STOP, gap=GAP, damping=DAMPER)],
        forces=[sl.Force("x1", FORCE)],
    )  # fmt: skip
    a, b = (sl.simulate(one, periods=5, progress=False) for one in (whole, STRUCTURE))
    for name in SENSORS:
        scale = np.abs(a[name].values).max()
        np.testing.assert_allclose(a[name], b[name], atol=1e-9 * scale, err_msg=name)
        assert a[name].attrs == b[name].attrs
    np.testing.assert_array_equal(a["tip"], a["x3"])
    assert not whole.outputs.first
    assert STRUCTURE.outputs.first
