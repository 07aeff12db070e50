"""Total variation with an L1 fidelity term, solved exactly."""
