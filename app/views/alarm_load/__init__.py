"""Load of operators by alarms, as ISA-18.2 counts it: rates, floods, chattering and stale ones, and the ten noisiest."""
