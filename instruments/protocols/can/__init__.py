"""Messages of a CAN bus: frames as bytes, signals by a DBC file, readings of the messages of one cycle."""
