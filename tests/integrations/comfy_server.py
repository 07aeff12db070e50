"""What a node pack meets of ComfyUI's server: how it is loaded, prompts are validated, and nodes are called.

Written after ComfyUI's ``nodes.load_custom_node``, ``execution.validate_inputs`` and
``execution.map_node_over_list``; ComfyUI itself is in no package registry, and needs a GPU's libraries.
"""

import importlib.util
import inspect
import sys
from types import SimpleNamespace

import numpy as np

KINDS = {"INT": int, "FLOAT": float, "STRING": str, "BOOLEAN": bool}
SOCKETS = {"IMAGE", "MASK", *KINDS}


class Tensor:
    """A stand-in for a tensor in memory, where there is no torch."""

    def __init__(self, array):
        self.array = array

    @property
    def shape(self):
        return self.array.shape

    def detach(self):
        return self

    def cpu(self):
        return self

    def numpy(self):
        return self.array


def torch_or_stand_in():
    if importlib.util.find_spec("torch"):
        import torch

        return torch
    return SimpleNamespace(Tensor=Tensor, from_numpy=Tensor)


def load(folder):
    """Load a node pack as ComfyUI does: by its path, under a name that is no package's."""
    name = str(folder).replace(".", "_x_")
    spec = importlib.util.spec_from_file_location(name, folder / "__init__.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def forget(module):
    for name in [name for name in sys.modules if name.startswith(module.__name__)]:
        del sys.modules[name]


class Server:
    """Runs prompts: {id: {"class_type": ..., "inputs": {name: value or [id, output]}}}.

    What a graph would load or make elsewhere is given: {id: {"tensor": ..., "kind": "IMAGE" or "MASK"}}.
    """

    def __init__(self, pack):
        self.classes = dict(pack.NODE_CLASS_MAPPINGS)

    def defaults(self, kind):
        """Return what the page fills a new node's widgets with."""
        wanted = self.classes[kind].INPUT_TYPES()
        both = {**wanted["required"], **wanted.get("optional", {})}
        return {name: about[1]["default"] for name, about in both.items() if "default" in about[1]}

    def validate(self, prompt, node):
        """Return why a node of a prompt would not run."""
        node_class, inputs = self.classes[prompt[node]["class_type"]], prompt[node]["inputs"]
        wanted, errors = node_class.INPUT_TYPES(), []
        validator = getattr(node_class, "VALIDATE_INPUTS", None)
        takes_all = bool(validator) and inspect.getfullargspec(validator).varkw is not None
        for name, (kind, about) in {**wanted["required"], **wanted.get("optional", {})}.items():
            if name not in inputs:
                if name in wanted["required"]:
                    errors.append(f"Required input is missing: {name}")
                continue
            value = inputs[name]
            if isinstance(value, list):
                source = prompt[value[0]]
                given = source.get("kind") or self.classes[source["class_type"]].RETURN_TYPES[value[1]]
                if given != kind:
                    errors.append(f"Return type mismatch between linked nodes: {name}, {given} != {kind}")
                continue
            if not isinstance(kind, list) and kind in KINDS:
                try:
                    value = inputs[name] = KINDS[kind](value)
                except ValueError:
                    errors.append(f"Failed to convert an input value to a {kind} value: {name}")
                    continue
            if not takes_all:
                if "min" in about and value < about["min"]:
                    errors.append(f"Value {value} smaller than min of {about['min']}: {name}")
                if "max" in about and value > about["max"]:
                    errors.append(f"Value {value} bigger than max of {about['max']}: {name}")
                if isinstance(kind, list) and value not in kind:
                    errors.append(f"Value not in list: {name}: '{value}' not in {kind}")
        if validator and not errors:
            told = validator(**{name: None if isinstance(v, list) else v for name, v in inputs.items()})
            if told is not True:
                errors.append(f"Custom validation failed for node: {told}")
        return errors

    def run(self, prompt, node, outputs=None):
        """Return the outputs of a node."""
        outputs = {} if outputs is None else outputs
        if node in outputs:
            return outputs[node]
        if "tensor" in prompt[node]:
            return (prompt[node]["tensor"],)
        errors = self.validate(prompt, node)
        assert not errors, errors
        node_class = self.classes[prompt[node]["class_type"]]
        values = {
            name: self.run(prompt, value[0], outputs)[value[1]] if isinstance(value, list) else value
            for name, value in prompt[node]["inputs"].items()
        }
        made = getattr(node_class(), node_class.FUNCTION)(**values)
        assert isinstance(made, tuple)
        assert len(made) == len(node_class.RETURN_TYPES)
        for kind, value in zip(node_class.RETURN_TYPES, made, strict=True):
            check(kind, value)
        outputs[node] = made
        return made


def check(kind, value):
    """Hold an output to what ComfyUI's other nodes take for granted."""
    if kind in ("IMAGE", "MASK"):
        array = value.numpy()
        assert array.dtype == np.float32
        assert array.ndim == {"IMAGE": 4, "MASK": 3}[kind]
        assert array.min() >= 0
        assert array.max() <= 1
        assert kind == "MASK" or array.shape[3] in (3, 4)
    else:
        assert isinstance(value, KINDS[kind])
