"""NI-DAQmx behind the gRPC device server of National Instruments: names, numbers and messages of its calls."""
