"""Page: published examples against what this program computes."""

from fastapi import APIRouter, Request, Response

from app.access.deps import require
from app.quality.proof import queries, wording
from app.web.templates import page

router = APIRouter(include_in_schema=False)


@router.get("/proof", dependencies=[require("viewer")])
def proof_page(request: Request) -> Response:
    """List the examples that are not as published first, then everything by topic."""
    proof = queries.proof()
    by_topic = [
        (heading, [result for result in proof.results if result.case.kind in kinds])
        for heading, kinds in wording.topics().values()
    ]
    return page(request, "proof/proof.html", proof=proof, topics=by_topic, wording=wording)
