"""The public names, and where each is at home. `__init__.py` reads them from here."""

from saltus.plot.agreement import agreement as agreement
from saltus.plot.backbone import backbone as backbone
from saltus.plot.basins import basins as basins
from saltus.plot.bifurcation import bifurcation_diagram as bifurcation_diagram
from saltus.plot.bifurcation_curves import bifurcation_curves as bifurcation_curves
from saltus.plot.branches import branches as branches
from saltus.plot.contact_forces import contact_forces as contact_forces
from saltus.plot.exponents import exponents as exponents
from saltus.plot.fit import fit as fit
from saltus.plot.frequency_response import frequency_response as frequency_response
from saltus.plot.gallery import gallery as gallery
from saltus.plot.history import history as history
from saltus.plot.measures import energy as energy
from saltus.plot.measures import impacts as impacts
from saltus.plot.methods import methods as methods
from saltus.plot.orbits import periodic_orbits as periodic_orbits
from saltus.plot.phase import phase as phase
from saltus.plot.scatter import corner as corner
from saltus.plot.scatter import scatter as scatter
from saltus.plot.section import section as section
from saltus.plot.sensitivity import sensitivity as sensitivity
from saltus.plot.spectrum import spectrum as spectrum
from saltus.plot.style import OKABE_ITO as OKABE_ITO
from saltus.plot.style import style as style
from saltus.plot.type_map import type_map as type_map
