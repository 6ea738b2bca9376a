"""LabJack T7 and T4: registers over Modbus TCP, and the packets of a stream."""
