"""Records with one fault each and clean ones, made by an author who had not read the checks."""
