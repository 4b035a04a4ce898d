"""The proof as JSON."""

from math import isnan

from pydantic import BaseModel, Field

from app.quality.proof.cases import Basis
from app.quality.proof.queries import Check, Proof, Result
from app.web.fields import answer_from

Number = float | bool
Numbers = Number | list[Number]


class CheckOut(BaseModel):
    """One number of an example, or one list of them."""

    name: str = Field(examples=["upper"])
    expected: Numbers = Field(description="As it was published, or as `basis` says.")
    got: Numbers | None = Field(description="What this program computes now.")
    tolerance: float = Field(description="How far apart they may be.")
    difference: float | None = Field(description="How far apart they are; of a list the entry that is furthest off.")
    passed: bool = Field(description="Both are the same within the tolerance.")

    @classmethod
    def of(cls, check: Check) -> "CheckOut":
        """From what the proof found."""
        difference = check.difference
        return answer_from(cls, check, difference=None if difference is None or isnan(difference) else difference)


class ExampleOut(BaseModel):
    """One example."""

    kind: str = Field(examples=["individuals"], description="What is computed.")
    name: str = Field(examples=["flow rate of ten batches"])
    source: str = Field(
        examples=["NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2.2"], description="Where it was published."
    )
    basis: Basis = Field(
        description="published in `source`; derived by hand, computed independently, or simulated, as `source` says.",
        examples=["published"],
    )
    note: str = Field(description="Why it cannot come out nearer, where that needs saying.")
    passed: bool = Field(description="Every number comes out as published.")
    error: str | None = Field(description="What went wrong when it could not be computed at all.")
    checks: list[CheckOut] = Field(description="Every number that was compared.")

    @classmethod
    def of(cls, result: Result) -> "ExampleOut":
        """From what the proof found."""
        return answer_from(
            cls,
            result.case,
            passed=result.passed,
            error=result.error,
            checks=[CheckOut.of(check) for check in result.checks],
        )


class ProofOut(BaseModel):
    """All published examples, run through the engine of this process."""

    passed: bool = Field(description="Every example comes out as published.")
    examples: int = Field(description="How many examples were run.")
    failing: int = Field(description="How many of them do not come out as published.")
    numbers: int = Field(description="How many numbers were compared.")
    results: list[ExampleOut] = Field(description="The examples.")

    @classmethod
    def of(cls, proof: Proof) -> "ProofOut":
        """From what the proof found."""
        return answer_from(
            cls,
            proof,
            examples=len(proof.results),
            failing=len(proof.failing),
            results=[ExampleOut.of(result) for result in proof.results],
        )
