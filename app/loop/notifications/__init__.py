"""Notifications: routes from alarms to receivers, messages by mail, webhook or apprise, and each delivery on record."""
