"""Sections, spectra, impacts and energies as Datasets: names, dims, units; through a file and back;
in words.
"""

import numpy as np
import pytest

import made_results
import saltus as sl
from motions_data import common, each, energy, impacts, section, spectrum
from saltus.errors import ParameterError
from saltus.results.dataset import schema

EVERY = {
    "section": section(), "section of two": section(2), "impacts": impacts(),
    "impacts of two": impacts(2), "energy": energy(),
    "energy of two": energy(2), "energy in time": energy(along="time"), "spectrum": spectrum(),
    "spectra": spectrum(2),
    "spectra of their own": spectrum(2, own=True),
}  # fmt: skip


@pytest.mark.parametrize("ds", EVERY.values(), ids=EVERY)
def test_through_a_file_and_back(ds, tmp_path):
    sl.save(ds, tmp_path / "result.nc")
    assert sl.load(tmp_path / "result.nc").identical(ds)


@pytest.mark.parametrize("ds", EVERY.values(), ids=EVERY)
def test_everything_has_a_name_and_a_unit(ds):
    for name in ds.variables:
        assert ds[name].attrs["long_name"]
        assert "units" in ds[name].attrs


@pytest.mark.parametrize(
    ("ds", "words"),
    [
        (section(), "x = 0.3 mm, both ways"),
        (
            impacts(),
            "lower_gap: 0.5 a second, at 0.5 m/s on average, in contact 50.00% of the time",
        ),
        (energy(), "0.003 J supplied and 0.002 J dissipated"),
        (spectrum(2), "9 lines up to 8 Hz, window none"),
    ],
)
def test_in_words(ds, words):
    assert words in sl.describe(ds)


def test_units_follow_the_system():
    assert section()["v"].attrs["units"] == "m/s"
    assert impacts()["speed_mean"].attrs["units"] == "m/s"
    assert spectrum()["x_amplitude"].attrs["units"] == "m"


def test_a_state_with_the_name_of_a_column_is_refused():
    with pytest.raises(
        ParameterError, match="the state 'crossings' has the name of something else"
    ):
        made_results.motion(
            schema.SECTION,
            **common(1, ("crossings",)),
            each=each(1),
            table={"crossings": np.zeros(2)},
        )
