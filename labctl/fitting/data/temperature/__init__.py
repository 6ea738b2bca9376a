"""Temperature of a recording: its thermometer, its course between data sets, its levels and legs."""
