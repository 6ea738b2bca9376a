"""Design of a campaign: what planned data sets will leave uncertain, before they are measured."""
