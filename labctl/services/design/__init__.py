"""Design of a campaign: the cheapest recipe on a bench that reaches an uncertainty."""
