"""Commands that change the database, executed here, by a service, or over HTTP."""
