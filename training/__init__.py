"""A prior of light on faces, learnt from renders of people who do not exist: docs/learned-prior.md."""
