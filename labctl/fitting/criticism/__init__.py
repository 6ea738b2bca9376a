"""A model held against measurements: lack of fit, where, suspects, and what cannot be told."""

from labctl.fitting.criticism.criticise import Criticism, criticise

__all__ = ["Criticism", "criticise"]
