"""Diagnoses: experiments run one after the other until one cause is left, or none can distinguish more."""
