"""JSON route: the proof."""

from app.access.deps import require
from app.quality.proof import queries
from app.quality.proof.schemas import ProofOut
from app.web.api import api_router

router = api_router("statistics")


@router.get("/proof", dependencies=[require("viewer")])
def get_proof() -> ProofOut:
    """Published examples run through the live engine: expected, got, tolerance. Run once per process."""
    return ProofOut.of(queries.proof())
