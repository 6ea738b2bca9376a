"""A simulated device of National Instruments behind NI's gRPC device server."""
