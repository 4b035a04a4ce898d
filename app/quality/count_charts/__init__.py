"""Charts of counts that are typed or sent: p, np, c and u. Nothing is stored."""
