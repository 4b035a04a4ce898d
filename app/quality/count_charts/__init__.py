"""Charts of counts that are typed or sent, such as p, np, c and u. Nothing is stored."""
