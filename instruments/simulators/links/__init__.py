"""Links to the simulated instruments: serial ports, Modbus clients, faults on the wire, and a server on real ports."""
