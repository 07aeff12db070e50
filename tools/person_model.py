"""Make the person model, `src/relit/face/models/selfie_segmentation.tflite`, out of MediaPipe's.

    npm pack @mediapipe/selfie_segmentation@0.1.1675465747
    python -m tools.person_model selfie_segmentation.tflite

As published, its last layer is an operation of MediaPipe's own, which LiteRT knows only through a delegate.
It is a transposed convolution and becomes LiteRT's; all else, the weights too, stays as it is.
"""

from __future__ import annotations

import sys
from pathlib import Path

import flatbuffers
import numpy as np
from ai_edge_litert import schema_py_generated as schema

_OUT = Path(__file__).parents[1] / "src/relit/face/models/selfie_segmentation.tflite"
_THEIRS = b"Convolution2DTransposeBias"
_OURS, _VERSION = schema.BuiltinOperator.TRANSPOSE_CONV, 3  # the first version with a bias


def rewritten(content: bytes) -> bytes:
    """Return a model with MediaPipe's transposed convolutions replaced by LiteRT's."""
    model = schema.ModelT.InitFromPackedBuf(content, 0)
    (graph,) = model.subgraphs
    (index,) = (k for k, code in enumerate(model.operatorCodes) if code.customCode == _THEIRS)
    code = model.operatorCodes[index]
    code.customCode, code.version = None, _VERSION
    code.builtinCode = code.deprecatedBuiltinCode = _OURS
    for operator in graph.operators:
        if operator.opcodeIndex != index:
            continue
        values, kernel, bias = operator.inputs
        padding, down, right = np.frombuffer(bytes(operator.customOptions), np.int32).tolist()
        size = schema.BufferT()
        size.data = np.frombuffer(
            np.asarray(graph.tensors[operator.outputs[0]].shape, np.int32).tobytes(), np.uint8
        )
        model.buffers.append(size)
        shape = schema.TensorT()
        shape.name, shape.shape, shape.type = b"segment/shape", [4], schema.TensorType.INT32
        shape.buffer = len(model.buffers) - 1
        graph.tensors.append(shape)
        options = schema.TransposeConvOptionsT()
        # MediaPipe counts kinds of padding from 1, as LiteRT's kernels do; models' files count from 0.
        options.padding, options.strideH, options.strideW = padding - 1, down, right
        operator.inputs = [len(graph.tensors) - 1, kernel, values, bias]
        operator.builtinOptionsType = schema.BuiltinOptions.TransposeConvOptions
        operator.builtinOptions, operator.customOptions = options, None
    builder = flatbuffers.Builder(len(content))
    builder.Finish(model.Pack(builder), b"TFL3")
    return bytes(builder.Output())


if __name__ == "__main__":
    _OUT.write_bytes(rewritten(Path(sys.argv[1]).read_bytes()))
