"""Several plants in one installation: the list of them, their addresses, and an overview.

A plant is a schema of the database with tables, people, keys and journal of its own. One server process serves all plants of
the list, each below ``/p/KEY`` or by a host name of its own; what a plant knows of itself stays without that beginning.
"""
