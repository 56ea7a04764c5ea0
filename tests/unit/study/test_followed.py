"""Sections, spectra, impact statistics and energy balances as questions of a study."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import saltus as sl
from saltus.errors import SaltusError, StudyError
from saltus.results import load
from saltus.results.kinds.spectrum import rows
from saltus.study.ask import questions_of
from saltus.study.read import parse
from saltus.study.run.running import Resources
from saltus.study.run.status import status_tables
from saltus.study.run.study import run_study
from saltus.study.setting.inputs import Inputs
from saltus.units import from_si

HEAD = """
[study]
name = "closely"
[system]
model = "delangre"
case = "b"
force = "4 N"
frequency = "15 Hz"
"""
START = 'start = { x = ["0.2 mm", "1 mm"], v = "0 m/s" }\n'
SECTION = (
    f'[[poincare]]\nname = "upper stop"\nsurface = "upper_gap"\ndirection = '
    f"1\n{START}periods = 20\ntransient = 30\n"
)
SPECTRUM = '[spectrum]\nstart = { x = "1 mm", v = "0 m/s" }\nperiods = 24\ntransient = 800\n'
IMPACTS = f"[impacts]\n{START}periods = 20\ntransient = 30\n"
ENERGY = '[energy]\nstart = { x = "1 mm", v = "0 m/s" }\nperiods = 20\n'
STUDY = HEAD + SECTION + SPECTRUM + IMPACTS + ENERGY
NAMES = {
    "poincare": "upper-stop",
    "spectrum": "spectrum",
    "impacts": "impact-statistics",
    "energy": "energy-balance",
}


def run(folder, text=STUDY, **options):
    said = []
    outcome = run_study(
        parse(text),
        text,
        folder,
        None,
        Resources(threads=1),
        lambda _: None,
        said.append,
        **({"pictures": False} | options),
    )
    return outcome, said


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The folder of a study that asks all four, and what came out."""
    folder = tmp_path_factory.mktemp("whole")
    return folder, run(folder, pictures=True)[0]


def table(whole, name):
    return pd.read_csv(whole[0] / f"{NAMES[name]}.csv", comment="#")


def rig():
    return sl.models.delangre("b", force="4 N", frequency="15 Hz")


# -- what comes out --------------------------------------------------------------------------------
def test_each_is_answered_with_data_a_table_and_a_picture(whole):
    forces = NAMES["impacts"] + "-forces.png"
    assert [file.name for file in whole[1].files if file.name != forces] == [
        f"{stem}.{kind}" for stem in NAMES.values() for kind in ("nc", "csv", "png")
    ]
    assert forces in [file.name for file in whole[1].files]
    assert all(file.stat().st_size > 500 for file in whole[1].files)
    assert [one.title for one in whole[1].tables] == [
        "upper stop",
        "Spectrum",
        "Impact statistics",
        "Energy balance",
    ]
    assert [row[2] for row in status_tables(whole[0])[0].rows] == ["done"] * 4


def test_a_section_at_a_guard_holds_its_contacts(whole):
    """The same contacts as those of a plain run, which knows nothing of sections."""
    motion = sl.contacts(
        sl.simulate(rig(), {"x": [0.2e-3, 1e-3], "v": 0.0}, periods=50, threads=1, progress=False)
    )
    late = motion[
        (motion["guard"] == "upper_gap") & (motion["direction"] == 1) & (motion["time"] > 30 / 15)
    ]
    found = table(whole, "poincare")
    assert len(late) > 20
    assert found["time [s]"].tolist() == late["time"].tolist()
    assert found["v [m/s]"].tolist() == late["v"].tolist()
    assert set(found["direction"]) == {1}
    assert found["phase of the forcing"].to_numpy() == pytest.approx(
        (found["time [s]"] * 15) % 1, abs=1e-12
    )


def test_impacts_count_the_contacts_of_a_section(whole):
    found, section = table(whole, "impacts"), table(whole, "poincare")
    upper = found[found["guard"] == "upper_gap"]
    assert upper["contacts"].tolist() == section.groupby("trajectory").size().tolist()
    assert upper["contacts per period"].to_numpy() == pytest.approx(upper["contacts"] / 20)
    assert upper["largest speed [m/s]"].to_numpy() == pytest.approx(
        section.groupby("trajectory")["v [m/s]"].max()
    )


def test_a_spectrum_is_that_of_the_last_periods(whole):
    """Parseval's relation, against the rms that a plain run has over the same periods."""
    found = table(whole, "spectrum")
    x = found["amplitude of x [m]"]
    last = sl.simulate(
        rig(), (1e-3, 0.0), periods=824, keep=3, samples=200, threads=1, progress=False
    )["x"].values[:-1]
    assert x[0] ** 2 + (x[1:-1] ** 2).sum() / 2 + x.iloc[-1] ** 2 == pytest.approx(
        np.mean(last**2), rel=1e-9
    )
    assert found["frequency [Hz]"][1] == 5.0  # it repeats after three forcing periods
    assert found["order"][3] == 1.0


def test_an_energy_balance_closes(whole):
    found = table(whole, "energy")
    left = found["supplied [J]"] - found["dissipated [J]"] - found["change [J]"]
    assert np.abs(left).max() < 1e-12 * found["stored at the end [J]"].max()
    assert found["stored at the end [J]"].diff()[1:].to_numpy() == pytest.approx(
        found["change [J]"][1:], abs=1e-15
    )
    assert found["period"].tolist() == list(range(1, 21))


def test_tables_are_plain_numbers(whole):
    for name in NAMES:
        frame = table(whole, name)
        assert set(frame.columns[~frame.dtypes.map(pd.api.types.is_numeric_dtype)]) <= {
            "guard",
            "kind",
        }, name


def test_without_forcing_lengths_are_times(tmp_path):
    """The transient is left out before the spectrum is taken."""
    text = (
        '[study]\nname = "free"\n[system]\nmodel = "aeroelastic"\n[spectrum]\nt_end = "2 '
        's"\ntransient = "1 s"\n'
    )
    text += 'samples = 200\nstates = ["{}"]\n'
    system = sl.models.aeroelastic()
    state = system.states[0]
    units = {name: system.units[name] for name in system.states}
    start = ", ".join(
        f"{name} = 0.01" if unit in ("", "1") else f'{name} = "0.01 {unit}"'
        for name, unit in units.items()
    )
    run(tmp_path, text.format(state) + f"start = {{ {start} }}\n")
    motion = sl.simulate(
        system,
        dict.fromkeys(system.states, 0.01),
        t_end=2.0,
        samples=200,
        threads=1,
        progress=False,
    )
    late = motion.isel(time=slice(100, None))
    found = load(tmp_path / "spectrum.nc")
    assert float(found["frequency"][1]) == pytest.approx(1.0)
    assert float(found[f"{state}_amplitude"][0]) == pytest.approx(
        abs(float(late[state][:-1].mean())), rel=1e-9
    )


def test_without_forcing_a_motion_has_the_samples_that_it_has_in_python_and_rows_name_what_varies(
    tmp_path,
):
    start = '{ plunge = "10 mm", pitch = "2 deg", plunge_rate = "0 m/s", pitch_rate = "0 rad/s" }'
    asked = f'start = {start}\nt_end = "1 s"\nvalues.airspeed = ["8 m/s", "9 m/s"]\n'
    head = '[study]\nname = "free"\n[system]\nmodel = "aeroelastic"\n'
    run(
        tmp_path,
        head
        + "".join(f"[{question}]\n{asked}" for question in ("simulate", "spectrum", "impacts")),
    )
    motion = sl.simulate(
        sl.models.aeroelastic(),
        t_end=1.0,
        values={"airspeed": [8.0, 9.0]},
        threads=1,
        progress=False,
    )
    assert load(tmp_path / "run.nc").sizes["time"] == motion.sizes["time"] > 1000
    for name in ("run", "spectrum", "impact-statistics"):
        frame = pd.read_csv(tmp_path / f"{name}.csv", comment="#")
        assert frame["airspeed [m/s]"].tolist() == [8.0 + one for one in frame["trajectory"]], name


def test_lines_of_rounding_are_not_printed():
    """A linear oscillator in its steady state has one line; the others are those of doubles."""

    @sl.system(states="x v", forced_at="f", units={"x": "m", "v": "m/s"})
    def linear(t, x, v, *, c="0.5 N*s/m", k="40 N/m", mass="1 kg", force="1 N", f="1.3 Hz"):
        return v, (force * sl.cos(2 * sl.pi * f * t) - k * x - c * v) / mass

    w = 2 * np.pi * 1.3
    steady = 1 / (40 - w**2 + 0.5j * w)
    motion = sl.simulate(linear, (steady.real, (1j * w * steady).real), periods=4, progress=False)
    lines = sl.spectrum(motion)
    (found,) = rows("lines", lines)
    assert [row[:3] for row in found.rows] == [("1.3", "1", from_si(abs(steady), "m"))]
    assert f"{lines.sizes['frequency'] - 1} of them no larger than rounding" in found.notes[-1]
    assert len(found.data) == lines.sizes["frequency"] + 1


def test_a_batch_of_frequencies_has_a_spectrum_each(tmp_path):
    text = HEAD + '[spectrum]\nperiods = 8\ntransient = 40\nvalues.frequency = ["14 Hz", "15 Hz"]\n'
    run(tmp_path, text, pictures=True)
    frame = pd.read_csv(tmp_path / "spectrum.csv", comment="#")
    assert sorted(set(frame["trajectory"])) == [0, 1]
    assert (tmp_path / "spectrum.png").exists()


# -- going on --------------------------------------------------------------------------------------
def test_what_is_there_is_not_computed_again(whole, monkeypatch):
    for name in ("simulate", "poincare", "impact_statistics", "energy_balance"):
        monkeypatch.setattr(
            f"{sl._HOMES[name]}.{name}", lambda *_, **__: pytest.fail("something is computed again")
        )
    again, said = run(whole[0])
    assert again.tables == whole[1].tables
    assert said == []
    assert [one.title for one in run(whole[0], only=["impacts"])[0].tables] == ["Impact statistics"]
    assert [one.title for one in run(whole[0], only=["upper stop"])[0].tables] == ["upper stop"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"upper_gap"', '{ x = "0.1 mm" }', "the surface changed since upper-stop.nc was written"),
        ("direction = 1\n", "", "the direction changed"),
    ],
)
def test_what_changed_is_computed_again(whole, tmp_path, monkeypatch, old, new, told):
    folder = tmp_path / "copy"
    folder.mkdir()
    (folder / "upper-stop.nc").write_bytes((whole[0] / "upper-stop.nc").read_bytes())
    calls = []
    monkeypatch.setattr(
        "saltus.analysis.motion.poincare.poincare",
        lambda *_, **call: calls.append(call) or load(folder / "upper-stop.nc"),
    )
    _, said = run(folder, STUDY.replace(old, new), only=["poincare"])
    assert told in said[0]
    assert len(calls) == 1


@pytest.mark.parametrize(
    "question", [SECTION, SPECTRUM, IMPACTS, ENERGY, "[lyapunov]\n", "[simulate]\nperiods = 3\n"]
)
def test_the_values_of_the_system_are_part_of_every_answer(question, tmp_path):
    """They aren't hidden by the values that the question itself may have."""

    def identity(text):
        return questions_of(parse(text), None, Inputs(tmp_path))[0].identity()

    before, after = identity(HEAD + question), identity(HEAD.replace("4 N", "5 N") + question)
    assert {name for name in before if before[name] != after[name]} == {"values"}
    varied = identity(HEAD + question + 'values.frequency = ["15 Hz", "16 Hz"]\n')
    assert {name for name in before if before[name] != varied[name]} == {"values of the question"}


# -- what is refused before anything is computed ---------------------------------------------------
@pytest.mark.parametrize(
    ("text", "told"),
    [
        (SECTION.replace('"upper_gap"', '"uper_gap"'), r"\[poincare\] surface = 'uper_gap' is "
                                                       r"unknown\. Did you mean 'upper_gap'\?"),
        (SECTION.replace('"upper_gap"', '"__import__(1)"'), r"\[poincare\] surface = "
            r"'__import__\(1\)' is unknown"),
        (SECTION.replace('"upper_gap"', "{ x = 0.3 }"), r'\[poincare\.surface\] x = 0\.3 has '
                                                        r'no unit'),
        (SECTION.replace('"upper_gap"', '{ x = "3 kg" }'), r"\[poincare\.surface\] x"),
        (SECTION.replace('"upper_gap"', '{ y = "3 mm" }'), r"\[poincare\.surface\] 'y' is unknown "
                                                           r"to delangre"),
        (SECTION.replace('"upper_gap"', '{ x = "3 mm", v = "1 m/s" }'), r"surface is a level of "
            r"one state"),
        (SECTION.replace('"upper_gap"', "3"), r"surface = 3 must be text in quotes\. For example: "
                                              r"surface = { x ="),
        (SECTION.replace('surface = "upper_gap"\n', ""), r"\[poincare\] lacks surface\. Write"),
        (SECTION.replace("direction = 1", "direction = 2"), r"direction = 2 must be 0, 1 or -1"),
        (SECTION.replace("direction", "directon"), r"no key 'directon'\. Did you mean "
                                                   r"'direction'\?"),
        (SECTION + SECTION, r"two \[\[poincare\]\] have the same name"),
        (SECTION + 'method = { name = "ODE45", events = "ignore" }\n', r"\[poincare\] needs a "
            r"method that locates contacts"),
        (SPECTRUM.replace("periods = 24\n", ""), r"\[spectrum\] give the length once"),
        (SPECTRUM.replace("periods = 24", 't_end = "2 s"'), r"\[spectrum\] delangre is forced\. "
            r"Write periods = 200 in place of t_end"),
        (SPECTRUM.replace("transient = 800", "transient = 1.5"), r"\[spectrum\] transient"),
        (SPECTRUM.replace("transient = 800", 'transient = "2 s"'), r"\[spectrum\] transient"),
        (SPECTRUM + 'states = ["y"]\n', r"\[spectrum\] states: 'y' is unknown to delangre"),
        (SPECTRUM + 'window = "hamming"\n', r"window = \"hamming\" must be 'none' or 'hann'"),
        (SPECTRUM + "last = 25\n", r"\[spectrum\] last = 25 are more forcing periods than are "
                                   r"looked at, periods = 24"),
        (IMPACTS + "contact_side = { uper_gap = 1 }\n", r"\[impacts\.contact_side\] 'uper_gap' is "
                                                        r"no boundary.*Did you mean 'upper_gap'"),
        (IMPACTS + "contact_side = { upper_gap = 2 }\n", r"contact_side\.upper_gap|upper_gap = 2 "
                                                         r"must be"),
        (IMPACTS + "bins = 0\n", r"bins = 0 must be greater than or equal to 1"),
        (IMPACTS + 'values = { frequency = ["14 Hz"] }\n', r"\[impacts\] lists must have the same "
                                                           r"length"),
        (ENERGY + "intervals = 10\n", r"\[energy\] delangre is forced.*Leave intervals out"),
        (ENERGY + 'energy = "mass*v"\n', r"\[energy\] lacks supplied\. .* or leave all three out: "
                                         r"the model brings them along"),
        (ENERGY + 'enrgy = "mass*v"\n', r"no key 'enrgy'\. Did you mean 'energy'\?"),
        ("[poincar]\n", r"no table 'poincar'\. Did you mean 'poincare'\?"),
    ],
)  # fmt: skip
def test_faults_are_told_before_anything_is_computed(text, told, tmp_path, monkeypatch):
    for name in ("simulate", "poincare", "impact_statistics", "energy_balance"):
        monkeypatch.setattr(
            f"{sl._HOMES[name]}.{name}", lambda *_, **__: pytest.fail("something is computed")
        )
    with pytest.raises(SaltusError, match=told):
        run(tmp_path, HEAD + text)
    assert list(tmp_path.iterdir()) == []


def test_systems_of_ones_own(tmp_path):
    """Sections of them are planned; an energy balance needs its formulas."""

    @sl.system(states="x v", units={"x": "m", "v": "m/s"})
    def free(t, x, v, *, stiffness=4.0):
        return v, -stiffness * x

    def asked(text):
        return questions_of(parse('[study]\nname = "a"\n' + text), free, Inputs(tmp_path))

    assert (
        asked('[poincare]\nsurface = "x turns"\nt_end = "2 s"\ntransient = "1 s"\n')[0].arguments[
            "transient"
        ]
        == 1.0
    )
    with pytest.raises(
        StudyError,
        match=r'\[energy\] lacks energy\. Write energy = "\.\.\." as a '
        r"formula, 0 if there is none\.$",
    ):
        asked('[energy]\nt_end = "2 s"\n')
    with pytest.raises(StudyError, match=r"\[impacts\] free has no boundary"):
        asked('[impacts]\nt_end = "2 s"\n')
    with pytest.raises(StudyError, match=r'\[spectrum\] free is not forced\. Write t_end = "20 s"'):
        asked("[spectrum]\nperiods = 20\n")
    with pytest.raises(StudyError, match=r"\[spectrum\] transient = 3\.0 must be a time"):
        asked('[spectrum]\nt_end = "2 s"\ntransient = "3 s"\n')
