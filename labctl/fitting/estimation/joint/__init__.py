"""Several recordings fitted together: what they agree on, and how well each is predicted by the others."""
