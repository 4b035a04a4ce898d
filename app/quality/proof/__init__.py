"""The proof: published examples, each with its source, run through the live engine.

`cases/*.json` hold them: what is given, what was published, and how near the engine must come. `engine` knows how each
kind is computed, by the same functions of the core that pages and decisions use; `queries.proof` runs them all, once per
process. The page /proof, `inband proof` and the tests read the same files.
"""
