"""The register of reference standards: certificates over time, drift, intermediate checks, and where each was used."""
