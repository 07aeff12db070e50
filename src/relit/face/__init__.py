"""Where a face and its parts are, what shape it has, and where its skin is."""
