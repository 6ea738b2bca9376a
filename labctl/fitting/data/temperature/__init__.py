"""Temperature of a recording: its thermometer, its profile between data sets, its levels and legs."""
