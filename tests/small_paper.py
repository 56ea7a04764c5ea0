"""A paper of two figures whose jobs take no time: what a replication does with it, whatever it
computes.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

import made_results
from saltus import models
from saltus.flow import Taylor
from saltus.replication import Check, Claim, Finding, Job, Numbers, Paper, Picture
from saltus.results import AttractorTable
from saltus.results.table import TextTable


def small_result(value):
    """A Dataset that any file can hold: one attractor of some peak."""
    table = AttractorTable(
        kind=["periodic"], period=np.array([1]), contacts=np.array([2.0]), itinerary=[""],
        peak=np.array([value]), rms=np.array([value]),
        margin=np.array([1.0]), multipliers=np.array([[0.5, 0.1]]), exponent=np.array([-1.0]),
        exponent_error=np.array([0.0]),
        points=[np.array([[value, 0.0]])],
    )  # fmt: skip
    return made_results.attractors(
        states=("x", "v"), units={"x": "m", "v": "m/s"}, attractors=table
    )


def compute(system, *inputs, value, progress, **_):
    progress(0.5)
    return small_result(value + sum(float(ds["attractor_peak"][0]) for ds in inputs))


def small_job(name, value, compute=compute, needs=()):
    return Job(name, compute, models.delangre("b"), Taylor(), {"value": value}, needs)


def draw(data):
    figure, ax = plt.subplots()
    ax.plot([0.0, 1.0])
    return figure


def judge(data):
    return Finding("one", "two", (Check("so it is", True),), "quite")


def table(data):
    return TextTable("numbers", ("a",), (("1",),))


#: Of Fig. 10.
_SOUND = compute, draw, judge


def small_paper(compute=compute, draw=draw, judge=judge, table=table):
    """Fig. 2, by the functions given: ``fig2/first`` and ``fig2/second``, which needs it. Fig. 10,
    always sound: ``fig10/other``.

    Its study files are those of a paper that there is; it doesn't read them.
    """
    sound, sound_draw, sound_judge = _SOUND
    jobs = [
        small_job("fig2/first", 1.0, compute),
        small_job("fig2/second", 2.0, sound, ("fig2/first",)),
        small_job("fig10/other", 3.0, sound),
    ]  # fmt: skip
    return Paper(
        name="saunders2021", title="A title", citation="Somebody (2021)", about="About it.",
        figures={"2": "the first", "10": "the second"}, jobs=lambda folder, quick: jobs,
        pictures=(
            Picture("2", "two", "Two", "How to read it.", ("fig2/second",), draw),
            Picture("10", "ten", "Ten", "How to read it.", ("fig10/other",), sound_draw),
        ),
        claims=(
            Claim("two-is", "2", "Two, it says, is so", "p. 2", "if so", ("fig2/second",), judge),
            Claim("ten-is", "10", "Ten is so", "p. 10", "if so", ("fig10/other",), sound_judge),
        ),
        tables=(Numbers("2", "numbers", ("fig2/first",), table),),
    )  # fmt: skip
