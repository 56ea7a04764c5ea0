"""The claims of this paper, in the order of the report."""

from saltus.replication.saunders2021.claims import attractor_claims, basin_claims, multistable, stiffness, validation
from saltus.replication.verdict import Claim


def _figure(claim: Claim) -> int:
    return int(claim.figure)


#: All claims, figure by figure.
CLAIMS = tuple(
    sorted((*validation.CLAIMS, *multistable.CLAIMS, *stiffness.CLAIMS, *basin_claims.CLAIMS, *attractor_claims.CLAIMS), key=_figure)
)
