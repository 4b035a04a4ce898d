"""Control plan: how often each characteristic is measured, and the measurements that were missed."""
