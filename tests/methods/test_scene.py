"""What a method gives."""

import numpy as np

from relit.methods.scene import Layers


def test_layers_are_made_once_and_when_they_are_asked_for():
    made = []

    def make():
        made.append(1)
        return {"person": np.ones((2, 2), np.float32)}

    layers = Layers(("person",), make)
    assert list(layers) == ["person"]
    assert not made
    assert dict(layers)["person"].sum() == 4
    assert len(layers) == 1
    assert made == [1]
