"""Structures with friction that begin at exact rest, slide nowhere or are pressed by forces that
begin at zero: against motions that are known, and random ones against Moreau's time stepping.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl
from saltus.flow.maps import Stroboscope

SEED = 20261
STRUCTURES = 12
#: Contacts of a structure of the test at most, degrees of freedom.
MOST, SIZE = 3, 4


def shaken(contacts, direction="x", stiffness=((4e3, 0.0), (0.0, 9e3)), sign=1.0):
    """Two masses on springs on a base that begins to shake from rest."""
    return sl.structure(
        np.eye(2), stiffness, modes=2, damping_ratio="1 %", names="x y", contacts=contacts,
        base=sl.Base({direction: sign}, lambda t: 8 * sl.sin(40 * t)),
    )  # fmt: skip


def moved(made, t_end=0.5, **more):
    """A run from exact rest that comes to its end."""
    run = sl.simulate(made, np.zeros(len(made.states)), t_end=t_end, progress=False, **more)
    assert str(run["status"].values) == "ok"
    return run


def ends(run):
    return [run[f"end_{name}"].item() for name in run.attrs["states"].split()]


SLIDES = {"friction": 0.3, "sliding": "y"}
LAWS = {
    "soft": {"stiffness": "50 kN/m"},
    "damped": {"stiffness": "50 kN/m", "damping": "20 N*s/m"},
    "both": {"stiffness": "50 kN/m", "side": "both"},
    "lower": {"stiffness": "50 kN/m", "side": "lower"},
    "curved": {"stiffness": "50 kN/m^1.5", "power": 1.5},
    "rigid": {"restitution": 0.0},
}


@pytest.mark.parametrize("gap", [0.0, 1e-3])
@pytest.mark.parametrize("law", LAWS)
def test_a_contact_that_nothing_slides_moves_as_without_friction(law, gap):
    """The direction of sliding stays at rest, whatever presses."""
    given = {"gap": gap} | LAWS[law]
    rough = moved(shaken([sl.Contact("x", **given, **SLIDES)]))
    if law == "damped":  # with friction it doesn't pull

        def rates(t, state):
            x, v = state
            force = max(5e4 * (x - gap) + 20 * v, 0.0) if x > gap else 0.0
            return v, -8 * math.sin(40 * t) - 4e3 * x - 0.02 * math.sqrt(4e3) * v - force

        found = solve_ivp(
            rates, (0, 0.5), (0, 0), method="DOP853", rtol=1e-10, atol=1e-13, max_step=1e-3
        )
        x, v = found.y[:, -1]
        assert ends(rough) == pytest.approx([x, 0.0, v, 0.0], rel=1e-6, abs=1e-8)
        return
    smooth = moved(shaken([sl.Contact("x", **given)]))
    assert smooth.sizes["contact"] > 5
    assert ends(rough) == pytest.approx(ends(smooth), rel=1e-9, abs=1e-14)
    assert ends(rough)[1] == ends(rough)[3] == 0.0


@pytest.mark.nojit
def test_friction_that_begins_with_its_contact_sticks():
    """A mass that rests in the direction of sliding, pressed by a spring's force from zero on."""
    run = moved(shaken([sl.Contact("x", gap=0.0, preload=5.0, stiffness=5e4, **SLIDES)]), 0.02)
    assert (ends(run)[1], ends(run)[3]) == (0.0, 0.0)


@pytest.mark.nojit
def test_a_stop_that_is_pressed_ever_more_from_rest_is_left_when_the_push_reverses():
    """The push is 8 sin(40 t): it begins at zero, and is away from the stop from pi/40 on."""
    run = moved(shaken([sl.Contact("x", gap=0.0, restitution=0.5)], sign=-1.0), 0.1)
    assert run["contact_kind"].values.tolist() == ["release"]
    assert run["contact_time"].item() == pytest.approx(math.pi / 40, rel=1e-12)


def test_a_structure_that_is_pressed_onto_a_rigid_stop_moves_as_if_it_were_held():
    """Three modes that move while their sum at the stop stays: the two other masses alone."""
    stiffness = np.array([[4e3, -1e3, 0.0], [-1e3, 9e3, -2e3], [0.0, -2e3, 2e4]])
    drive = sl.recorded(np.linspace(0, 0.6, 61), np.sin(np.linspace(0, 9, 61)) ** 2, name="quake")
    push = np.array([1.0, 0.5, -0.3])
    made = sl.structure(
        np.eye(3), stiffness, modes=3, base=sl.Base(push, drive),
        contacts=[sl.Contact("x1", restitution=0.5, gap=0.0, preload=20.0)],
    )  # fmt: skip
    run = moved(made)
    shapes = sl.structure_modes(np.eye(3), stiffness, 3)["shape"].values
    x = shapes @ ends(run)[:3]

    def rates(t, state):
        return [*state[2:], *(-stiffness[1:, 1:] @ state[:2] - push[1:] * float(drive(t)))]

    truth = solve_ivp(
        rates, (0, 0.5), np.zeros(4), method="DOP853", rtol=1e-10, atol=1e-14, max_step=1e-3
    )
    assert x == pytest.approx([0.0, *truth.y[:2, -1]], abs=1e-10)
    assert run.sizes["contact"] == 0


@pytest.mark.nojit
def test_a_curved_contact_that_is_entered_with_the_third_power_of_time():
    """The first step may not leave its force out: the depth begins as t**3."""
    stop = sl.Contact("x", gap=0.0, stiffness=2e5, power=1.5)
    run = moved(sl.structure([[1.0]], [[3950.0]], names="x", contacts=[stop],
                base=sl.Base("x", lambda t: -14.5 * sl.sin(38.7 * t))), 0.05)  # fmt: skip

    def rates(t, state):
        x, v = state
        return v, 14.5 * math.sin(38.7 * t) - 3950.0 * x - 2e5 * max(x, 0.0) ** 1.5

    truth = solve_ivp(
        rates, (0, 0.05), (0, 0), method="DOP853", rtol=1e-12, atol=1e-17, max_step=1e-4
    )
    assert ends(run) == pytest.approx(truth.y[:, -1], rel=1e-10)


@pytest.mark.parametrize("stiffness", [1e4, 4.5e4, 2e5])
def test_a_curved_contact_that_is_entered_from_rest_on_a_stop(stiffness):
    """The third power of time is behind the rounding of the modes when the stop lets go."""
    squares = np.array([[4e3, -5e2], [-5e2, 9e3]])
    stops = [
        sl.Contact("x", gap=0.0, restitution=0.0),
        sl.Contact("x", gap=0.0, stiffness=stiffness, power=1.5, side="lower"),
    ]
    made = sl.structure(
        np.eye(2), squares, modes=2, damping_ratio="1 %", names="x y", contacts=stops,
        base=sl.Base({"x": 1.0, "y": 1.0}, lambda t: 30 * sl.sin(40 * t)),
    )  # fmt: skip
    run = sl.simulate(made, (-1e-3, 0, 0, 0), t_end=0.3, progress=False)
    kinds = run.contact_kind.values.tolist()
    first = kinds.index("release")
    shapes = sl.structure_modes(np.eye(2), squares, 2)["shape"].values
    modal = [run[f"contact_{name}"].values[first] for name in made.states]
    (_, y), (_, u) = shapes @ modal[:2], shapes @ modal[2:]
    damping = shapes @ np.diag(0.02 * np.sqrt(np.linalg.eigvalsh(squares))) @ shapes.T

    def rates(t, state):
        x, v = state[:2], state[2:]
        force = -squares @ x - damping @ v - 30 * math.sin(40 * t)
        return [*v, force[0] + stiffness * max(-x[0], 0.0) ** 1.5, force[1]]

    def comes_back(t, state):
        return state[0] if t > begin + 1e-3 else -1.0

    comes_back.terminal, begin = True, run.contact_time.values[first]
    truth = solve_ivp(rates, (begin, 0.3), (0.0, y, 0.0, u), method="DOP853", rtol=1e-11,
                      atol=1e-15, max_step=1e-3, events=comes_back)  # fmt: skip
    after = kinds.index("impact", first)
    assert run.contact_time.values[after] == pytest.approx(truth.t[-1], abs=1e-10)


def test_the_derivative_where_friction_begins_at_zero_against_finite_differences():
    """What slides there when the contact closes is stopped in a time that goes as the root of its
    speed, so the difference is one over 1e-10 m.
    """
    made = sl.structure(
        np.eye(2), [[4e3, 0.0], [0.0, 9e3]], modes=2, damping_ratio="1 %", names="x y",
        base=sl.Base("x", "8 m/s^2"), frequency="6.366 Hz",
        contacts=[sl.Contact("x", stiffness="50 kN/m", gap="1 mm", **SLIDES)],
    )  # fmt: skip
    start = np.zeros((1, 4))
    _, tangent = Stroboscope(made, sl.Taylor()).tangent(start, np.array([1]))
    for i, small in ((0, 1e-6), (1, 1e-10)):
        beside = np.outer([small, -small], np.eye(4)[i])
        run = sl.simulate(made, beside, periods=1, progress=False)
        forth, back = (np.array([run[f"end_{name}"].values[k] for name in made.states])
                       for k in range(2))  # fmt: skip
        found = (forth - back) / (2 * small)
        assert tangent[0][:, i] == pytest.approx(found, abs=5e-3 * np.abs(found).max())


def test_curved_contacts_on_both_sides_can_stick():
    """Whose depths are no numbers where they aren't touched, once raised to 1.5."""
    law = {"stiffness": 1e6, "power": 1.5, "side": "both"}
    made = shaken([sl.Contact("x", gap=1e-4, **law, **SLIDES)])
    assert [one.law.kind for one in made.guards if one.law] == ["surface", "hold"]


# -- random structures -----------------------------------------------------------------------------
def drawn(random):
    """A random structure: its size, stiffness, damping ratio, base, drive and contacts. Nothing
    slides along a rigid stop's own direction: what friction there would take of its force isn't
    said.
    """
    n = int(random.integers(2, SIZE + 1))
    axes = np.eye(n) if random.random() < 0.4 else np.linalg.qr(random.normal(size=(n, n)))[0]
    stiffness = axes @ np.diag(random.uniform(30, 150, n) ** 2) @ axes.T
    moves = random.normal(size=n) * (random.random(n) < 0.6)
    moves[0] = moves[0] or 1.0
    amplitude, rate, phase = random.uniform(3, 20), random.uniform(20, 90), random.integers(2)
    contacts = []
    for number in range(int(random.integers(1, MOST + 1))):
        at, along = random.permutation(n)[:2].tolist()
        slide = [one["sliding"] for one in contacts]
        stopped = [one["at"] for one in contacts if "restitution" in one]
        rough = random.random() < 0.7 and along not in slide + stopped
        given = {
            "at": at, "sliding": along if rough else None, "name": f"s{number}",
            "side": str(random.choice(["upper", "lower"])),
            "gap": 0.0 if random.random() < 0.4 else float(random.uniform(1e-4, 2e-3)),
            "preload": float(random.uniform(1, 20)) if random.random() < 0.5 else None,
            "friction": float(random.uniform(0.1, 0.8)) if rough else None,
        }  # fmt: skip
        if random.random() < 0.4 and at not in slide + stopped:
            given["restitution"] = 0.0 if rough else float(random.uniform(0, 0.8))
        else:
            given["stiffness"] = float(10 ** random.uniform(3.7, 5.0))
        contacts.append(given)
    return n, stiffness, 0.02, moves, (amplitude, rate, phase * math.pi / 2), contacts


def ours(n, stiffness, ratio, moves, drive, contacts, t_end):
    """Status and deflections at the end, by both methods that stay on a boundary."""
    names = [f"x{i + 1}" for i in range(n)]
    stops = [
        sl.Contact(**given | {"at": names[given["at"]]}
                   | ({} if given["sliding"] is None else {"sliding": names[given["sliding"]]}))
        for given in contacts
    ]  # fmt: skip
    a, w, phase = drive
    made = sl.structure(
        np.eye(n), stiffness, modes=n, damping_ratio=ratio, contacts=stops,
        base=sl.Base(moves, lambda t: a * sl.sin(w * t + phase)),
    )  # fmt: skip
    shapes = sl.structure_modes(np.eye(n), stiffness, n)["shape"].values
    for method in (sl.Taylor(), sl.Modal()):
        run = sl.simulate(made, np.zeros(2 * n), t_end=t_end, method=method, progress=False)
        yield str(run["status"].values), shapes @ ends(run)[:n]


def stepped(n, stiffness, ratio, moves, drive, contacts, t_end, step):
    """Deflections at the end by Moreau's time stepping: impulses of contacts by Gauss and Seidel.
    Moreau, Unilateral contact and dry friction in finite freedom dynamics (1988).
    """
    squares, axes = np.linalg.eigh(stiffness)
    damping = axes @ np.diag(2 * ratio * np.sqrt(squares)) @ axes.T
    solved = np.linalg.inv(np.eye(n) + 0.5 * step * damping)
    x, v = np.zeros(n), np.zeros(n)
    for number in range(round(t_end / step)):
        middle = x + 0.5 * step * v
        shake = drive[0] * math.sin(drive[1] * (number + 0.5) * step + drive[2])
        force = -moves * shake - stiffness @ middle - 0.5 * damping @ v
        closed = []
        for one in contacts:
            sign, at = 1.0 if one["side"] == "upper" else -1.0, one["at"]
            depth = sign * middle[at] - one["gap"]
            force[at] += sign * (one["preload"] or 0.0)
            pressed = one.get("stiffness", 0.0) * max(depth, 0.0)
            force[at] -= sign * pressed
            if depth >= 0:
                closed.append((one, sign, step * pressed, max(sign * v[at], 0.0)))
        v = solved @ (v + step * force)
        blows, rubs = [0.0] * len(closed), [0.0] * len(closed)
        for _ in range(20 if closed else 0):
            for k, (one, sign, pressed, came) in enumerate(closed):
                if "restitution" in one:
                    wanted = blows[k] + sign * v[one["at"]] + one["restitution"] * came
                    wanted = max(wanted, 0.0)
                    v[one["at"]] -= sign * (wanted - blows[k])
                    blows[k], pressed = wanted, max(wanted - came, 0.0)  # a blow has no friction
                if one["sliding"] is not None:
                    most = one["friction"] * pressed
                    wanted = min(max(rubs[k] + v[one["sliding"]], -most), most)
                    v[one["sliding"]] -= wanted - rubs[k]
                    rubs[k] = wanted
        x = middle + 0.5 * step * v
    return x


@pytest.mark.parametrize("number", range(STRUCTURES))
def test_random_structures_against_time_stepping(number):
    """The steps' error is of first order, about the change when they are halved. A gap that begins
    with a high power of time, below the rounding of its modes, may be touched either way.
    """
    given = drawn(np.random.default_rng([SEED, number]))
    coarse, fine = (stepped(*given, 0.1, step) for step in (1e-4, 5e-5))
    allowed = 4 * np.abs(coarse - fine).max() + 1e-3 * np.abs(fine).max()
    for status, x in ours(*given, 0.1):
        assert status in ("ok", "graze_unresolved")
        assert np.abs(x - fine).max() < allowed
