"""The wall screen: machines, alarms and parts of the running shift, to be read from five metres, opened by a key of its own."""
