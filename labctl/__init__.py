"""labctl calibrates gyroscopes: command line, HTTP service, pages, fitting and criticism."""
