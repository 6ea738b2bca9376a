"""The far end of a wire: serial port, Modbus device, faults, and a server on real ports."""
