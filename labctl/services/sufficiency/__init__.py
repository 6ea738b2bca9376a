"""Whether a campaign has measured enough: U of its fit while it runs."""
