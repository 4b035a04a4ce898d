"""The page of one characteristic: zone chart, results, decisions."""
