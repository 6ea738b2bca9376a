"""Opening a serial port or a Modbus link, and the times of streamed samples."""
