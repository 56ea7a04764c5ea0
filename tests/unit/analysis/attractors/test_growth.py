"""Growth of deviations where there are many states, and what typing a motion may cost."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors import aperiodic, grid_responses
from saltus.analysis.attractors.find_responses import KEPT_ITERATES, find_responses
from saltus.analysis.attractors.growth import BUDGET, by_neighbours, growth_rates, tangent_cost
from saltus.analysis.solve.tolerances import ROUND
from saltus.flow.flight import Flight
from saltus.flow.maps import Stroboscope
from saltus.results.dataset.kinds import Kind

#: Natural frequencies without a common period [rad/s].
NATURAL = np.sqrt([40.0, 130.0, 310.0])


def oscillators(damping):
    """Three forced oscillators beside one another: six states."""

    @sl.system(states="a b c da db dc", forced_at="frequency", units={"frequency": "Hz"})
    def three(t, a, b, c, da, db, dc, *, frequency=1.0, damping=damping):
        drive = sl.cos(2 * sl.pi * frequency * t)
        return (
            da, db, dc,
            drive - 40.0 * a - 2 * damping * da,
            drive - 130.0 * b - 2 * damping * db,
            drive - 310.0 * c - 2 * damping * dc,
        )  # fmt: skip

    return three


def start():
    return np.array([[0.1, -0.05, 0.02, 0.0, 0.3, 0.0]])


def chain(contact, damping_ratio=0.02, frequency=13.0):
    """Four masses between springs, the first one driven, with a stop."""
    stiffness = 1e4 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    return sl.structure(
        np.eye(4), stiffness, frequency=frequency, damping_ratio=damping_ratio, modes=4,
        contacts=[contact], forces=[sl.Force("x1", 5.0)],
    )  # fmt: skip


@pytest.fixture
def spent(monkeypatch):
    """Cost of everything that is integrated [iterates]; a list of the shares shown."""
    costs = []
    advance, tangent = Flight.advance, Stroboscope.tangent

    def moved(self, periods):
        costs.append(periods * len(self))
        return advance(self, periods)

    def carried(self, state, count, directions=None):
        costs.append(tangent_cost(state.shape[1]) * int(np.sum(np.broadcast_to(count, len(state)))))
        return tangent(self, state, count, directions)

    monkeypatch.setattr(Flight, "advance", moved)
    monkeypatch.setattr(Stroboscope, "tangent", carried)
    return costs


@pytest.mark.filterwarnings("error")
def test_rounding_of_a_state_that_has_decayed_is_no_growth():
    map_, scale = Stroboscope(oscillators(0.02), sl.Modal()), np.ones((1, 6))
    scale[0, 2] = 1e-170
    rates = [growth_rates(map_, start(), one, 32)[1].mean() for one in (scale, np.ones((1, 6)))]
    assert rates[0] == pytest.approx(-0.02, abs=2e-3)
    assert rates[1] == pytest.approx(-0.02, abs=2e-3)


@pytest.mark.parametrize("damping", [0.0, 0.02])
def test_a_neighbour_comes_nearer_as_damping_says(damping):
    """All deviations from a linear motion shrink by exp(-damping T)."""
    map_ = Stroboscope(oscillators(damping), sl.Taylor(), threads=1)
    assert by_neighbours(map_, 6)
    scale = np.array([[0.1, 0.1, 0.1, 1.0, 1.0, 1.0]])
    _, rates = growth_rates(map_, start(), scale)
    # a block's length swings with the phase; over all blocks that is bounded
    assert rates.mean() == pytest.approx(-damping, abs=2.0 / (8 * len(rates)))


def test_a_neighbour_tells_chaos_at_the_rate_that_the_tangent_flow_tells(monkeypatch):
    """Duffing's oscillator, beside two more that are at rest."""

    @sl.system(states="x v a b c", forced_at="frequency", units={"frequency": "Hz"})
    def duffing(t, x, v, a, b, c, *, frequency=1 / (2 * np.pi), force=7.5):
        return v, force * sl.cos(2 * sl.pi * frequency * t) - 0.05 * v - x * x * x, -a, -b, -c

    map_ = Stroboscope(duffing, sl.Taylor(), threads=1)
    begin, scale = np.array([[3.0, 4.0, 0.0, 0.0, 0.0]]), np.array([[6.0, 10.0, 1.0, 1.0, 1.0]])
    _, [kind] = aperiodic.kinds_of(map_, begin, scale, [[0]])
    monkeypatch.setattr("saltus.analysis.attractors.growth.by_neighbours", lambda *_: False)
    _, rates = growth_rates(map_, begin, scale)
    error = np.hypot(kind[2], rates.std() / np.sqrt(len(rates)))
    assert kind[0] == "chaotic"
    assert abs(kind[1] - rates.mean()) < 5 * error


@pytest.mark.parametrize("damping", [0.0, 0.02])
def test_a_neighbour_along_the_past_comes_nearer_as_damping_says(damping, spent):
    """The motion itself isn't moved again: each block costs its neighbour alone."""
    map_ = Stroboscope(oscillators(damping), sl.Taylor(), threads=1)
    past = map_.launch(start(), 1601).advance(1601)
    spent.clear()
    scale = np.array([[0.1, 0.1, 0.1, 1.0, 1.0, 1.0]])
    end, rates = growth_rates(map_, past[:, -1], scale, 200, past)
    assert rates.mean() == pytest.approx(-damping, abs=2.0 / (8 * len(rates)))
    assert sum(spent) == 200 * 8
    assert (end == past[:, -1]).all()


@pytest.mark.parametrize("damping", [0.0, 0.02])
def test_one_direction_shrinks_as_damping_says_where_a_flow_carries_it_alone(damping):
    """Along the past too, whose end is given back to the bit."""
    map_ = Stroboscope(oscillators(damping), sl.Modal(), threads=1)
    assert map_.carries(1)
    assert not by_neighbours(map_, 6)
    past = map_.launch(start(), 801).advance(801)
    scale = np.array([[0.1, 0.1, 0.1, 1.0, 1.0, 1.0]])
    for before in (None, past):
        end, rates = growth_rates(map_, past[:, -1], scale, 100, before)
        assert rates.mean() == pytest.approx(-damping, abs=2.0 / (8 * len(rates)))
        assert (end == past[:, -1]).all() == (before is not None)


def test_growth_along_one_direction_is_that_of_the_whole_tangent():
    """A stop with restitution, which no neighbour may pass: the same blocks either way."""
    map_ = Stroboscope(chain(sl.Contact("x4", restitution=0.7, gap="0.2 mm")), sl.Modal())
    begin, scale = map_.ends(np.zeros((1, 8)), 40)[0], np.ones((1, 8))
    direction = np.random.default_rng(3).normal(size=(1, 8))
    end, images = map_.images(begin, 8, direction[:, :, None])
    whole_end, whole = map_.tangent(begin, 8)
    np.testing.assert_allclose(end, whole_end, rtol=0, atol=1e-9 * np.abs(whole_end).max())
    size = np.abs(whole @ direction[:, :, None]).max()
    np.testing.assert_allclose(images, whole @ direction[:, :, None], rtol=0, atol=1e-6 * size)
    _, rates = growth_rates(map_, begin, scale, 16)
    assert np.isfinite(rates).all()


@pytest.mark.parametrize("most", [200, 400])
def test_a_motion_that_nothing_tells_costs_what_its_budget_allows(spent, monkeypatch, most):
    monkeypatch.setattr(aperiodic, "kind_of_growth", lambda _: None)
    map_ = Stroboscope(oscillators(0.0), sl.Taylor(), threads=1)
    settled = find_responses(map_, start(), most, 1)
    assert settled.kind.tolist() == [Kind.NOT_REPEATING]
    followed = 2 * (most + ROUND) + ROUND
    assert sum(spent) <= BUDGET * most + followed * (1 + BUDGET) + 2 * KEPT_ITERATES


def test_what_was_left_out_is_said(monkeypatch):
    monkeypatch.setattr(aperiodic, "kind_of_growth", lambda _: None)
    shares = []
    ds = sl.frequency_response(
        oscillators(0.0), [1.0], start=start()[0], periods=200, progress=shares.append, threads=1
    )
    assert ds.type.item() == "not_repeating"
    # cos(wt) of all three: at most the sum of both amplitudes
    forced = 1.0 / abs(40.0 - (2 * np.pi) ** 2)
    peak = float(ds.output_peak.sel(output="a").item())
    assert 0.5 * forced < peak <= (2 * forced + 0.1) * (1 + 1e-9)
    assert "periods=" in sl.describe(ds)
    assert shares == sorted(shares)


def test_ctrl_c_hands_out_the_frequencies_that_are_done():
    """One whose motion never repeats is still at work when the others are known."""
    system = oscillators(0.0).with_values()

    def press(share):
        if share >= 0.5:
            raise KeyboardInterrupt

    with pytest.raises(sl.Interrupted) as stop:
        sl.bifurcation_diagram(
            system,
            {"damping": [0.0, 0.5, 0.6]},
            start=start()[0],
            periods=20_000,
            progress=press,
            threads=1,
        )
    part = stop.value.partial
    assert part.type.values[1:].ravel().tolist() == ["periodic", "periodic"]
    assert part.type.values[0].item() == "not_computed"


@sl.system(states="x v", forced_at="f", units={"f": "Hz"})
def hammer(t, x, v, *, force=7.0, gap=1e-4, f=28.0):
    """A mass on a spring that chatters against a stop until it rests."""
    push = force * sl.cos(2 * sl.pi * f * t) - 4.0 * v - 4e3 * x
    return v, push, sl.impact(x < gap, v, restitution=0.8)


def test_a_motion_that_rests_on_a_stop_goes_on_where_no_deviation_is_left():
    map_ = Stroboscope(hammer, sl.Taylor(), threads=1)
    scale = np.array([[1e-2, 0.1]])
    state, rates = growth_rates(map_, np.zeros((1, 2)), scale, 32)
    assert np.isfinite(state).all()
    assert np.isneginf(rates).any()
    assert not np.isnan(rates).any()


def test_ctrl_c_does_not_wait_for_numbers(monkeypatch):
    """Those of the frequencies that are done were computed when these were found."""
    system = oscillators(0.5)

    def press(share):
        if share >= 0.75:
            raise KeyboardInterrupt

    frequencies = np.linspace(1.0, 2.0, 4)
    whole = sl.frequency_response(system, frequencies, threads=1, progress=False)
    with pytest.raises(sl.Interrupted) as stop:
        sl.frequency_response(system, frequencies, start="sweep_up", threads=1, progress=press)
    monkeypatch.setattr(grid_responses, "numbers_of", None)
    part = stop.value.partial
    assert (part.type.values != "not_computed").sum() >= 3
    np.testing.assert_allclose(part.rms.values[:3], whole.rms.values[:3], rtol=1e-9)
