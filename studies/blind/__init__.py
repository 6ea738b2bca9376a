"""Records with one fault each and clean ones, made by somebody who had not read the checks."""
