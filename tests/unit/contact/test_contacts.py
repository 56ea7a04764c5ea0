"""Laws of contact as they are traced: jumps, forces that hold, reduced equations - against closed
forms, and against linear systems that NumPy solves.
"""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError, SaltusError, TraceError, UnitError
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.system import System
from saltus.system.modes import field, sides
from saltus.system.quantity import acting_guards, with_integrals, with_surface
from saltus.system.read_off import quantity
from saltus.system.tangent import tangent_system

RANDOM = np.random.default_rng(40)


@sl.system(states="x v", forced_at="frequency")
def stop(t, x, v, *, gap=1.0, restitution=0.8, damping=0.1, force=1.0, frequency=0.25):
    push = force * sl.cos(2 * sl.pi * frequency * t)
    return v, push - damping * v - x, sl.impact(x < gap, v, restitution=restitution)


@sl.system(states="x v")
def belt(t, x, v, *, stiffness=2.0, mass=3.0, speed=0.2, slip=0.5, stick=1.0):
    return v, (-stiffness * x - sl.friction(v - speed, slip=slip, stick=stick)) / mass


def numbers(system: System, roots: tuple[Expr, ...], t: float, y, held: tuple[int, ...] = ()):
    """Values of expressions with the state's sides, and some hold guards set."""
    bits = [number in held or side for number, side in enumerate(sides(system, t, y))]
    states = dict(zip(system.states, y, strict=True))
    found = evaluate(roots, t=t, states=states, values=system.values, bits=bits)
    return np.array(found, dtype=float)


def rates(system: System, t: float, y, held: tuple[int, ...] = ()):
    return numbers(system, system.field, t, y, held)


def matrix_problem(count: int, total: int):
    """Numbers for `total` two-valued forces on `count` masses whose mass matrix is full."""
    root = RANDOM.normal(size=(count, count))
    flexibility = np.linalg.inv(root @ root.T + count * np.eye(count))
    normals = RANDOM.normal(size=(total, count)).round(3)
    return flexibility, normals, RANDOM.uniform(0.5, 2, total), RANDOM.normal(size=count)


def friction_web(flexibility, normals, strengths, push) -> System:
    """Masses with a full mass matrix, rubbing on one another and on the ground."""
    count = len(push)

    def web(t, *v):
        slides = [sum(float(n) * u for n, u in zip(row, v, strict=True)) for row in normals]
        forces = [
            float(push[i])
            - sum(
                float(mu * row[i]) * sl.sign(z)
                for mu, row, z in zip(strengths, normals, slides, strict=True)
            )
            for i in range(count)
        ]
        return [
            sum(float(flexibility[i, k]) * forces[k] for k in range(count)) for i in range(count)
        ]

    return sl.system(states=[f"v{i}" for i in range(count)])(web)


class TestImpact:
    def test_against_a_stop(self):
        (guard, hold), law = stop.guards, stop.guards[0].law
        t, y = 0.3, np.array([1.0, 0.7])
        push = np.cos(0.5 * np.pi * t)
        assert (guard.name, hold.name, law.kind, law.side) == ("gap", "gap at rest", "impact", -1)
        assert numbers(stop, law.reset, t, y).tolist() == [1.0, -0.8 * 0.7]
        assert numbers(stop, law.settled, t, y).tolist() == [1.0, 0.0]
        assert numbers(stop, (law.drive, law.pivot), t, y) == pytest.approx([push - 1.07, -1])
        assert hold.gap is law.drive
        assert rates(stop, t, y) == pytest.approx([0.7, push - 1.07], rel=1e-15)
        assert rates(stop, t, [1.0, 0.0], (1,)).tolist() == [0.0, 0.0]

    def test_below(self):
        @sl.system(states="x v")
        def ball(t, x, v, *, gravity=9.81):
            return v, -gravity, sl.impact(x > 0, -v, restitution=0.5)

        law = ball.guards[0].law
        assert law.side == 1
        assert numbers(ball, law.reset, 0.0, [0.0, -3.0]).tolist() == [0.0, 1.5]
        assert numbers(ball, (law.drive, law.constraint), 0.0, [0.0, -3.0]).tolist() == [9.81, 3.0]

    def test_a_stop_that_moves(self):
        @sl.system(states="x v")
        def shaken(t, x, v, *, a=0.3, w=2.0):
            return v, -x, sl.impact(x < 1 + a * sl.sin(w * t), v - a * w * sl.cos(w * t),
                                    restitution=0.6)  # fmt: skip

        t, law = 0.4, shaken.guards[0].law
        wall, rate = 0.6 * np.cos(0.8), -1.2 * np.sin(0.8)
        y = [1 + 0.3 * np.sin(0.8), 2.0]
        after = numbers(shaken, law.reset, t, y)
        assert after[1] - wall == pytest.approx(-0.6 * (2.0 - wall), rel=1e-15)
        assert numbers(shaken, law.settled, t, y)[1] == pytest.approx(wall, rel=1e-15)
        assert numbers(shaken, (law.drive,), t, y) == pytest.approx(-y[0] - rate, rel=1e-14)
        assert rates(shaken, t, [y[0], wall], (1,)) == pytest.approx([wall, rate], rel=1e-15)

    def test_two_masses(self):
        @sl.system(states="x1 v1 x2 v2")
        def pair(t, x1, v1, x2, v2, *, m1=2.0, m2=5.0, e=0.7, k=3.0):
            law = sl.impact(x1 < x2, v1 - v2, restitution=e, inertia=(m1, m2))
            return v1, -k * x1 / m1, v2, (1.0 - k * x2) / m2, law

        law, y = pair.guards[0].law, np.array([0.4, 3.0, 0.4, -1.0])
        for roots, e in ((law.reset, 0.7), (law.settled, 0.0)):
            after = numbers(pair, roots, 0.0, y)
            assert 2 * after[1] + 5 * after[3] == pytest.approx(2 * 3.0 - 5 * 1.0, rel=1e-14)
            assert after[1] - after[3] == pytest.approx(-e * 4.0, abs=1e-14)
        force = np.array([-3 * 0.4, 1.0 - 3 * 0.4])
        held = rates(pair, 0.0, y, (1,))
        assert held[1] == held[3] == pytest.approx(force.sum() / 7, rel=1e-14)
        assert numbers(pair, (law.drive, law.pivot), 0.0, y) == pytest.approx(
            [force[0] / 2 - force[1] / 5, -(1 / 2 + 1 / 5)], rel=1e-14
        )

    def test_inertia_by_name_where_the_velocity_holds_positions(self):
        @sl.system(states="q p y u")
        def cam(t, q, p, y, u, *, disc=2.0, m=0.5):
            closing = p * sl.cos(q) - u
            law = sl.impact(sl.sin(q) < y, closing, restitution=0.4, inertia={"p": disc, "u": m})
            return p, 0.0, u, -9.81, law

        law, y = cam.guards[0].law, np.array([0.6, 2.0, np.sin(0.6), -0.3])
        after, c = numbers(cam, law.reset, 0.0, y), np.cos(0.6)
        assert after[1] * c - after[3] == pytest.approx(-0.4 * (2 * c + 0.3), rel=1e-14)
        # the impulse acts along (c, -1)
        assert 2.0 * (after[1] - 2.0) / c == pytest.approx(-0.5 * (after[3] + 0.3), rel=1e-14)

    def test_contacts_in_a_row_at_rest(self):
        """Masses pressed on one another: any of the contacts held, as NumPy solves it."""
        masses, pushes = (1.0, 2.0, 4.0, 3.0), (5.0, 1.0, -2.0, 0.5)

        @sl.system(states="x1 x2 x3 x4 v1 v2 v3 v4")
        def row(t, *y):
            x, v = y[:4], y[4:]
            laws = [
                sl.impact(
                    x[i] < x[i + 1], v[i] - v[i + 1], restitution=0.5, inertia=masses[i : i + 2]
                )
                for i in range(3)
            ]
            return [*v, *(p / m for p, m in zip(pushes, masses, strict=True)), *laws]  # fmt: skip

        inverse, free = np.diag(1 / np.array(masses)), np.array(pushes) / masses
        y, normals = np.zeros(8), np.array([[1, -1, 0, 0], [0, 1, -1, 0], [0, 0, 1, -1]])
        for held in itertools.chain.from_iterable(
            itertools.combinations(range(3), size) for size in range(4)
        ):
            n = normals[list(held)]
            share = np.linalg.solve(n @ inverse @ n.T, n @ free)
            wanted = free - inverse @ n.T @ share
            bits = tuple(3 + i for i in held)
            assert rates(row, 0.0, y, bits)[4:] == pytest.approx(wanted, rel=1e-13)
            assert np.all(n @ rates(row, 0.0, y, bits)[4:] == 0)
            for own, number in enumerate(held):
                others = tuple(bit for bit in bits if bit != 3 + number)
                rest = normals[[i for i in held if i != number]]
                cut = np.linalg.solve(rest @ inverse @ rest.T, rest @ free)
                drive = normals[number] @ (free - inverse @ rest.T @ cut)
                law = row.guards[number].law
                for bits_set in (others, bits):  # its own bit changes nothing in it
                    found = numbers(row, (law.drive, law.pivot), 0.0, y, bits_set)
                    assert found[0] == pytest.approx(drive, rel=1e-12, abs=1e-13)
                    # force on the contact: drive over the effective flexibility
                    assert -found[0] / found[1] == pytest.approx(share[own], rel=1e-12)


class TestSurfaces:
    def test_a_block_on_a_belt(self):
        (guard, hold), law = belt.guards, belt.guards[0].law
        y = [0.4, 0.2]
        assert (law.kind, hold.name, law.zeros, guard.state) == ("surface", "speed held", 1, "v")
        assert numbers(belt, (law.drive, law.pivot, law.limit), 0.0, y) == pytest.approx(
            [-0.8 / 3, -0.5 / 3, 2.0]
        )
        assert numbers(belt, (hold.gap,), 0.0, y) == pytest.approx((1 - 0.8**2) / 9)
        assert rates(belt, 0.0, y, (1,)).tolist() == [0.2, 0.0]
        assert rates(belt, 0.0, [0.4, 0.5])[1] == pytest.approx((-0.8 - 0.5) / 3)
        assert numbers(belt, law.settled, 0.0, [0.4, 0.2 + 1e-12]).tolist() == [0.4, 0.2]

    def test_coulomb_friction_fades_smoothly(self):
        @sl.system(states="v")
        def block(t, v, *, mu=0.4):
            return sl.sin(t) - mu * sl.sign(v)

        law = block.guards[0].law
        assert (law.limit.payload, law.zeros) == (1.0, 2)

    def test_friction_that_depends_on_the_velocity(self):
        """Stribeck's law: at rest the strength is that of zero velocity."""

        @sl.system(states="x v")
        def strib(t, x, v, *, speed=0.2, delta=3.0, top=1.5):
            z = v - speed
            return v, -x - sl.friction(z, slip=1 / (1 + delta * sl.abs(z)), stick=top)

        law = strib.guards[0].law
        found = numbers(strib, (law.drive, law.pivot, law.limit), 0.0, [0.3, 0.2])
        assert found == pytest.approx([-0.3, -1.0, 1.5], rel=1e-15)

    @pytest.mark.parametrize("parts", [(2, 2), (3, 3), (4, 3), (5, 4)])
    def test_blocks_that_rub_on_one_another(self, parts):
        """Random masses and frictions: any of the surfaces held, as NumPy solves it."""
        flexibility, normals, strengths, push = matrix_problem(*parts)
        web = friction_web(flexibility, normals, strengths, push)
        count = len(normals)
        assert len(web.guards) == 2 * count
        v = RANDOM.normal(size=parts[0])
        own = np.array([numbers(web, g.law.normal, 0.0, v) for g in web.guards[:count]])
        assert np.array_equal(own, normals)
        signs, mu = np.sign(normals @ v), strengths
        for size in range(count + 1):
            for held in itertools.combinations(range(count), size):
                free = [i for i in range(count) if i not in held]
                pull = push - own[free].T @ (mu[free] * signs[free])
                n = own[list(held)]
                rest = flexibility @ pull
                share = np.linalg.solve(n @ flexibility @ n.T, n @ rest)
                wanted = rest - flexibility @ n.T @ share
                bits = tuple(count + i for i in held)
                assert rates(web, 0.0, v, bits) == pytest.approx(wanted, rel=1e-11, abs=1e-12)
                for place, i in enumerate(held):
                    law = web.guards[i].law
                    drive, pivot = numbers(web, (law.drive, law.pivot), 0.0, v, bits)
                    # the force that holds it, in units of its strength
                    assert -drive / pivot == pytest.approx(share[place] / mu[i], rel=1e-10)

    def test_a_planar_field_slides_as_a_convex_combination(self):
        up, down = np.array([-1.0, 3.0]), np.array([0.5, 2.0])

        @sl.system(states="x y")
        def plane(t, x, y):
            above = x - 2 * y > 0.5
            return tuple(sl.where(above, a, b) for a, b in zip(up, down, strict=True))

        normal = np.array([1.0, -2.0])
        alpha = normal @ down / (normal @ (down - up))
        assert rates(plane, 0.0, [0.5, 0.0], (1,)) == pytest.approx(
            alpha * up + (1 - alpha) * down, rel=1e-15
        )

    def test_conditions_that_are_joined(self):
        """Friction only while pressed: the sign stands in a joined condition."""

        @sl.system(states="x v")
        def rub(t, x, v, *, mu=0.7):
            force = sl.piecewise((mu, (v > 0) & (x > 0)), (-mu, (v < 0) & (x > 0)), otherwise=0)
            return v, 1 - x - force

        names = [guard.name for guard in rub.guards]
        held = rub.guards[names.index("v = 0")].law
        assert numbers(rub, (held.drive, held.pivot), 0.0, [0.5, 0.0]) == pytest.approx([0.5, -0.7])
        assert numbers(rub, (held.pivot,), 0.0, [-0.5, 0.0]) == pytest.approx([0.0])

    @pytest.mark.parametrize(
        "force",
        [
            lambda x, v: v * sl.abs(v),  # continuous at v = 0
            lambda x, v: sl.piecewise((5 * (x - 1) + 3 * v, x > 1), otherwise=0),
            lambda x, v: sl.sign(x),
            lambda x, v: sl.max(v, 0.0) * 2,
            lambda x, v: sl.table(v, [-1.0, 0.3, 1.0, 2.5], [0.1, 0.7, 0.2, 0.4]),
        ],
    )
    def test_boundaries_that_nothing_holds_have_no_law(self, force):
        system = sl.system(states="x v")(lambda t, x, v: (v, -x - force(x, v)))
        assert system.guards
        assert not any(guard.law for guard in system.guards)
        assert system.to_dict()["format"] == "saltus-system/1"


class TestJumps:
    def test_new_values(self):
        @sl.system(states="x v n")
        def counted(t, x, v, n, *, e=0.5):
            return v, -x, 0.0, sl.jump(x > 1, v=-e * v + t, n=n + 1)

        law = counted.guards[0].law
        assert (law.kind, law.side, law.partner, len(counted.guards)) == ("jump", -1, -1, 1)
        assert numbers(counted, law.reset, 2.0, [1.0, 4.0, 7.0]).tolist() == [1.0, 0.0, 8.0]

    def test_from_above(self):
        system = sl.system(states="x v")(lambda t, x, v: (v, -x, sl.jump(x < 1, v=0)))
        assert system.guards[0].law.side == 1


class TestSystems:
    def test_the_equations_as_they_were_written(self):
        assert stop.equations() == [
            "dx/dt = v",
            "dv/dt = force*cos(2*pi*frequency*t) - damping*v - x",
            "x > gap: v becomes -restitution*v",
        ]
        text = str(stop.with_values(restitution=0.3))
        assert "gap  impact with restitution 0.3 at x = gap  (1)" in text
        assert "2 states, 1 guard," in text
        assert "speed  sticks or slides at v = speed  (0.2), held by up to stick/slip times" in str(
            belt
        )
        assert "at rest" not in text + stop._repr_html_() + str(stop.equations())

    @pytest.mark.parametrize("system", [stop, belt], ids=lambda one: one.name)
    def test_data(self, system):
        data = json.loads(json.dumps(system.to_dict()))
        again = System.from_dict(data)
        assert data["format"] == "saltus-system/2"
        assert (again.to_dict(), again.fingerprint()) == (data, system.fingerprint())
        other = system.with_values(**dict.fromkeys(list(system.values)[:1], 1.5))
        assert other.fingerprint() == system.fingerprint()
        for change in ({"side": 7}, {"partner": 0}, {"kind": "magic"}, {"drive": 10**6}):
            data["guards"][0][4] |= change
            with pytest.raises(SaltusError, match="damaged"):
                System.from_dict(data)
            data = json.loads(json.dumps(system.to_dict()))

    def test_the_law_is_part_of_the_fingerprint(self):
        def with_restitution(e):
            return sl.system(states="x v")(
                lambda t, x, v: (v, -x, sl.impact(x < 1, v, restitution=e))
            )

        assert with_restitution(0.5).fingerprint() != with_restitution(0.6).fingerprint()

    def test_rhs_knows_no_holding(self):
        assert stop.rhs(0.0, [1.0, 0.0]).tolist() == [0.0, 0.0]
        assert belt.rhs(0.0, np.array([[0.4, 0.4], [0.5, 0.2]])).shape == (2, 2)
        assert field(belt, 0.0, [0.0, 0.2])[1] == pytest.approx(0.5 / 3)  # at v = speed: below

    def test_a_surface_and_integrals_stand_behind_hold_guards(self):
        crossed = with_surface(stop, lambda x: x - 0.3, "level")
        assert [guard.name for guard in crossed.guards] == ["gap", "gap at rest", "level"]
        assert acting_guards(crossed) == (0, 1)
        work = with_integrals(belt, {"work": lambda v, speed, slip: slip * sl.sign(v - speed) * v})
        assert len(work.guards) == 2
        assert len(work.guards[0].law.settled) == 3
        tangent = tangent_system(stop)
        assert tangent.guards == stop.guards
        assert len(tangent.guards[0].law.reset) == 2

    def test_friction_that_sticks_is_the_force_that_holds(self):
        force, _ = quantity(belt, lambda v, speed, slip: slip * sl.sign(v - speed))
        y = [0.4, 0.2]
        assert numbers(belt, (force,), 0.0, y, (1,)) == pytest.approx(-2 * 0.4)
        assert numbers(belt, (force,), 0.0, [0.4, 0.9]) == pytest.approx(0.5)

    def test_a_quantity_never_means_a_hold_guard(self):
        """A comparison that equals the gap of a hold guard is a boundary of its own."""

        @sl.system(states="x v", forced_at="f")
        def ball(t, x, v, *, f=1.0):
            return v, sl.cos(2 * sl.pi * f * t) - x, sl.impact(x > 0, -v, restitution=0.5)

        _, guards = quantity(
            ball, lambda t, x, f: sl.where(-(sl.cos(2 * sl.pi * f * t) - x) > 0, 1, 0)
        )
        assert len(guards) == 3

    def test_names(self):
        @sl.system(states="x v", guards={"the wall": lambda x, gap: x > gap})
        def named(t, x, v, *, gap=1.0):
            return v, -x, sl.impact(x < gap, v, restitution=0.5)

        assert [guard.name for guard in named.guards] == ["the wall", "the wall at rest"]

    def test_a_jump_that_does_not_repeat(self):
        with pytest.raises(TraceError, match="what an impact or a jump sets"):
            sl.system(states="x v", forced_at="f")(
                lambda t, x, v, *, f=1.0: (v, sl.cos(2 * sl.pi * f * t) - x, sl.jump(x > 1, v=t))
            )


UNITS = {"x": "m", "v": "m/s"}


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (
            lambda t, x, v: (v, -x, sl.impact(x < 1, v, restitution=1.1)),
            r"1\.1 is outside \[0, 1\]",
        ),
        (lambda t, x, v: (v, -x, sl.impact(x < 1, -v, restitution=0)), "closes is v, but -v was"),
        (lambda t, x, v: (v, -x, sl.impact(x < 1, 3.0, restitution=0)), "velocity at which the"),
        (lambda t, x, v: (v, -x, sl.impact(x < 1, v + x, restitution=0)), "Add inertia="),
        (
            lambda t, x, v: (v, -x, sl.impact(x < 1, v, restitution=0, inertia=(1, 2))),
            "got 2 inertias.*holds 1 states",
        ),
        (
            lambda t, x, v: (v, -x, sl.impact(x < 1, v, restitution=0, inertia={"x": 1})),
            "inertia= names 'x'",
        ),
        (
            lambda t, x, v: (v, -x, sl.impact(x < 1, v, restitution=0, inertia=(-1,))),
            "must be positive",
        ),
        (lambda t, x, v: (v, -x - sl.impact(x < 1, v, restitution=0)), "law of the contact, not a"),
        (lambda t, x, v: (sl.impact(x < 1, v, restitution=0), v, -x), "before a rate"),
        (
            lambda t, x, v: (v, -x + 0 * sl.impact(x < 1, v, restitution=0).parts["velocity"]),
            "isn't returned",
        ),
        (lambda t, x, v: (v, -x, sl.jump(x > 1, w=0)), "sets 'w', which is no state"),
        (lambda t, x, v: (v, -x, sl.jump(x > 1)), "needs the states that jump"),
        (lambda t, x, v: (v, -x, sl.jump((x > 1) & (v > 0), v=0)), "several joined by"),
        (lambda t, x, v: (v, -x, sl.jump(sl.sin(t) > 0, v=0)), "decided by the time alone"),
        (lambda t, x, v: (v, -x, sl.jump(x > 1, v=sl.mod(t, 1.0))), "holds a clock"),
        (
            lambda t, x, v: (v, -x, sl.impact(x < sl.mod(t, 1.0), v - 1, restitution=0)),
            "place of the stop holds a clock",
        ),
        (
            lambda t, x, v: (v, -x, sl.jump(x > 1, v=0), sl.jump(x > 1, v=1)),
            "two laws stand for the contact at x = 1",
        ),
        (lambda t, x, v: (v, -x - sl.friction(v, slip=1, stick=0.5)), "stick is 0.5 times slip"),
        (
            lambda t, x, v, *, a=1.0, b=2.0: (
                v,
                -x - sl.friction(v, slip=a, stick=b) - sl.friction(v, slip=b, stick=2 * b),
            ),
            "two friction laws with different limits",
        ),
    ],
)
def test_mistakes(function, says):
    with pytest.raises(TraceError, match=says):
        sl.system(states="x v")(function)


def test_values_out_of_range():
    with pytest.raises(ParameterError, match=r"stop, contact 'gap': the restitution 1\.1"):
        stop.with_values(restitution=1.1)
    with pytest.raises(ParameterError, match=r"the restitution -0.1 is outside"):
        sl.stroboscope(stop, [(0, 0), (0, 0)], 1, values={"restitution": [0.5, -0.1]})
    with pytest.raises(ParameterError, match=r"belt, contact 'speed': stick is 0.5 times slip"):
        belt.with_values(slip=2.0)


@pytest.mark.parametrize(
    ("law", "says"),
    [
        (lambda x, v, k: sl.impact(x < k, v / k, restitution=0), "velocity is to be in m/s"),
        (lambda x, v, k: sl.impact(x < k, v, restitution=k), "restitution is to be a plain number"),
        (lambda x, v, k: sl.jump(x > k, v=k), "v is to be in m/s"),
    ],
)
def test_units(law, says):
    with pytest.raises(UnitError, match=says):
        sl.system(states="x v", units=UNITS)(
            lambda t, x, v, *, k="1 m", g="1 m/s^2": (v, g, law(x, v, k))
        )
    with pytest.raises(UnitError, match="added or compared"):
        sl.system(states="x v", units=UNITS)(
            lambda t, x, v, *, a="1 m/s^2", b="1 m": (v, -sl.friction(v, slip=a, stick=b))
        )
