"""The Acme G1: protocol, driver and simulator."""
