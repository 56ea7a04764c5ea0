"""B. E. Saunders, R. Vasconcellos, R. J. Kuether and A. Abdelkefi (2021), from its study files to its verdicts."""

from saltus.replication.papers import Paper
from saltus.replication.saunders2021.claims import CLAIMS
from saltus.replication.saunders2021.pictures import PICTURES
from saltus.replication.saunders2021.plan import jobs
from saltus.replication.saunders2021.tables import TABLES

FIGURES = {
    "2": "event location, and Table 2", "3": "frequency responses of six cases", "4": "two responses at 17 Hz", "5": "four starts at 15 Hz",
    "6": "basins at four frequencies", "7": "from soft to hard contact", "8": "basins around a grazing", "9": "attractors before the grazing",
    "10": "attractors after the grazing", "11": "basins around a period doubling", "12": "attractors around the period doubling",
    "13": "basins at stiff contact", "14": "attractors at stiff contact",
}  # fmt: skip

PAPER = Paper(
    name="saunders2021",
    title="Relationship between the contact force strength and numerical inaccuracies in piecewise-smooth systems",
    citation="B. E. Saunders, R. Vasconcellos, R. J. Kuether, A. Abdelkefi (2021)",
    about=(
        "The paper asks how MATLAB's ode45 goes wrong on a vibrating block with freeplay when contacts are not located, and how that depends "
        "on how hard the contact is. Here the same computations are made three times: by ode45 with and without event location, rebuilt "
        "from its rules (the printed contact times come out to 2e-15 s), and by Taylor series with every contact, exact but for rounding."
    ),
    figures=FIGURES,
    jobs=jobs,
    pictures=PICTURES,
    claims=CLAIMS,
    tables=TABLES,
)
