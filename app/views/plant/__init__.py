"""The whole plant at a glance: every machine and characteristic with its state, for the page that stays open all day."""
