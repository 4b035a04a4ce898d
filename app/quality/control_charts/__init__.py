"""Control charts: readings judged by a frozen baseline, drawn with the signals of the rules."""
