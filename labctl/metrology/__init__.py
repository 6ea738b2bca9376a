"""Metrology of reference standards: drift between certificates, control charts, comparisons of laboratories."""
