"""Functions that read results: over one that was changed they say so, and a mistake of saltus stays
one.
"""

import matplotlib as mpl
import pytest

from motions_data import impacts, section
from saltus.errors import ParameterError
from saltus.plot import history
from saltus.plot import impacts as draw_impacts
from saltus.plot import section as draw_section
from saltus.results import describe, save
from saltus.results.dataset.reader import reader
from saltus.results.provenance import content_hash
from unit.results.conftest import sine_run

mpl.use("Agg")


@pytest.mark.parametrize(
    ("read", "changed"),
    [
        (describe, lambda: sine_run().assign_attrs(units="x y z")),
        (describe, lambda: sine_run().assign_attrs(varied_parameters="5")),
        (describe, lambda: sine_run().assign_attrs(parameters="[" * 100_000)),
        (describe, lambda: impacts().rename_dims(contact="event")),
        (
            draw_impacts,
            lambda: impacts().drop_vars("speed_low").assign(speed_low=(("q", "r"), [[1.0, 2.0]])),
        ),
        (draw_section, lambda: section().assign(crossing_direction=("q", [1, 2]))),
        (history, lambda: sine_run().assign(x=("contact", sine_run()["contact_time"].values))),
    ],
)
def test_a_changed_result_is_told_apart(read, changed):
    with pytest.raises(ParameterError, match=r"ends in .*isn't as saltus made it|misses|lost"):
        read(changed())


def test_what_fails_over_a_result_as_it_was_is_raised_as_it_is():
    run = sine_run()
    run = run.assign_attrs(result_hash=content_hash(run))

    @reader
    def mistaken(ds, more=None):
        raise KeyError(ds.sizes["time"])

    with pytest.raises(KeyError):
        mistaken(run)
    with pytest.raises(ParameterError, match="mistaken ends in KeyError"):
        mistaken(run, more=[run.isel(time=[0])])
    with pytest.raises(ParameterError, match="no suffix"):
        save(run, "run.txt")
