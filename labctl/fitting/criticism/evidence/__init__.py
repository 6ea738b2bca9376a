"""Evidence of the data for each option on one axis: noise, elimination of the base, Bayes factors."""
