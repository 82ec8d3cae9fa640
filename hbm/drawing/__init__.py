"""Pictures of results: what is drawn, as plain data, and its drawing by matplotlib."""
