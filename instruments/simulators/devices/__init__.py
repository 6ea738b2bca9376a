"""One simulated instrument per protocol; `instruments/simulators/registry.py` lists them by kind."""
