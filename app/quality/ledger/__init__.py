"""The ledger: rejects that corrections have prevented and caused, in pieces and in the plant's money."""
