"""Connections: heartbeats of the bridges beside the machines, and alarms when these fall silent or back up."""
