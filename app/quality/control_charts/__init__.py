"""Control charts: baselines frozen on purpose, and the readings since judged by them."""
