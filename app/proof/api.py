"""JSON route: the proof."""

from app.proof import queries
from app.proof.schemas import ProofOut
from app.web.api import api_router
from app.web.deps import require

router = api_router("statistics")


@router.get("/proof", dependencies=[require("viewer")])
def get_proof() -> ProofOut:
    """Published examples run through the live engine: expected, got, tolerance. Run once per process."""
    return ProofOut.of(queries.proof())
