"""ONNX files, looked at before anything runs them: a network of heatmaps, and nothing that could do harm.

A file may come from anywhere. What is let through has operators of one short list, floating-point numbers all
the way, and sizes that are known beforehand and bounded. Nothing here runs a network.
"""

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import onnx
import onnx.checker
import onnx.shape_inference
from google.protobuf.message import DecodeError
from onnx import AttributeProto, GraphProto, ModelProto, NodeProto, TensorProto, ValueInfoProto, numpy_helper

OPERATORS = frozenset(
    {
        "Add",
        "AveragePool",
        "BatchNormalization",
        "Cast",
        "Clip",
        "Concat",
        "Constant",
        "Conv",
        "ConvTranspose",
        "Div",
        "Elu",
        "Flatten",
        "Gemm",
        "GlobalAveragePool",
        "Identity",
        "LeakyRelu",
        "MatMul",
        "MaxPool",
        "Mul",
        "Pad",
        "Relu",
        "Reshape",
        "Resize",
        "Sigmoid",
        "Softmax",
        "Squeeze",
        "Sub",
        "Tanh",
        "Transpose",
        "Unsqueeze",
    }
)
"""What a network may be made of. Nothing on the list chooses a size from data, or computes with integers. A
Cast only turns weights that are kept in half precision into what is computed with."""

IR_VERSIONS = range(7, 11)
OPSETS = range(13, 23)

_STANDARD_DOMAINS = ("", "ai.onnx")
_MOST_PARTS = 20_000
"""Nodes, tensors and metadata of a file; the networks of the thesis have a few hundred."""
_MOST_AXES = 8
_LARGEST_INTEGER = 1 << 24
"""No kernel, stride or size is larger, and products of a few of them do not overflow anywhere."""
_LONGEST_INTEGERS = 64
_MOST_BYTES = 1 << 30
"""Of all values between the nodes together."""
_MOST_PRODUCTS = 10**12
"""Multiplications of one volume: six times those of V2V-PoseNet at full resolution."""
_FROM_ONE = ("strides", "dilations", "kernel_shape", "group")
_FROM_ZERO = ("pads", "output_padding", "output_shape", "count_include_pad", "ceil_mode", "storage_order")
_PLAIN_ATTRIBUTES = (
    AttributeProto.FLOAT,
    AttributeProto.INT,
    AttributeProto.STRING,
    AttributeProto.TENSOR,
    AttributeProto.FLOATS,
    AttributeProto.INTS,
    AttributeProto.STRINGS,
)
_ITEM_BYTES: dict[int, int] = {TensorProto.FLOAT: 4, TensorProto.FLOAT16: 2, TensorProto.INT64: 8}

Shape = tuple[int, ...]


class GraphProblem(ValueError):  # noqa: N818 - turned into a CheckpointError, which is what a user meets
    """What is wrong with an ONNX file, and where there is one, what can be done about it."""

    def __init__(self, problem: str, remedy: str = "") -> None:
        super().__init__(problem)
        self.remedy = remedy


def parse_model(content: bytes) -> ModelProto:
    """Read the bytes of an ONNX file, without looking at what they say.

    Fields that ONNX does not know are dropped: no other reader can see something else in them.

    Raises
    ------
    GraphProblem
        They are not ONNX, or hold no network.
    """
    if not content:
        raise GraphProblem("the file is empty")
    if content.startswith(b"PK\x03\x04") or content[:2] in (
        b"\x80\x02",
        b"\x80\x03",
        b"\x80\x04",
        b"\x80\x05",
    ):
        raise GraphProblem(
            "it looks like a file of PyTorch, which can hold code and is not opened",
            "If this project's training wrote it, make a checkpoint of it: annotations checkpoint convert",
        )
    try:
        model: ModelProto = ModelProto.FromString(content)
        model.DiscardUnknownFields()
    except DecodeError as error:
        raise GraphProblem("it is not an ONNX file, or is truncated or damaged") from error
    if not model.HasField("graph") or not model.graph.node:
        raise GraphProblem("it is not an ONNX file, or holds no network")
    graph = model.graph
    if len(graph.node) + len(graph.initializer) + len(model.metadata_props) > _MOST_PARTS:
        raise GraphProblem(f"it has more than {_MOST_PARTS} parts, which no such network has")
    return model


def metadata_text(model: ModelProto, key: str) -> str | None:
    """Return the text of a model's metadata under a key; None if there is none.

    Raises
    ------
    GraphProblem
        The key stands there twice, or its text is no Unicode.
    """
    found = [entry.value for entry in model.metadata_props if entry.key == key]
    if len(found) > 1:
        raise GraphProblem(f"its metadata have {key!r} twice")
    if found and not isinstance(found[0], str):
        raise GraphProblem(f"its metadata {key!r} are not text (UTF-8)")
    return found[0] if found else None


def set_metadata(model: ModelProto, key: str, text: str) -> None:
    """Make a text the model's only metadata, and leave out what else was noted while it was exported.

    Exporters note the places of source files on the maker's machine, which are nobody else's business.
    """
    del model.metadata_props[:]
    model.metadata_props.add(key=key, value=text)
    model.ClearField("doc_string")
    graph = model.graph
    for part in (graph, *graph.node, *graph.initializer, *graph.input, *graph.output, *graph.value_info):
        part.ClearField("doc_string")
        part.ClearField("metadata_props")


def check_model(model: ModelProto, input_shape: Shape, output_shape: Shape) -> None:
    """Refuse a model that is not a plain network from one input to one output of these shapes.

    Cheap checks come first: what is odd never reaches the ones that are written in C++.

    Parameters
    ----------
    model : ModelProto
    input_shape, output_shape : tuple of int
        What the network must take and give, as float32.

    Raises
    ------
    GraphProblem
        Naming what does not fit: version, operator, tensor, shape, or size.
    """
    _check_versions(model)
    graph = model.graph
    if model.functions:
        raise GraphProblem("it defines operators of its own")
    if model.training_info or graph.sparse_initializer:
        raise GraphProblem("it holds more than a network: sparse weights, or how to train it")
    for node in graph.node:
        _check_node(node)
    for tensor in _tensors(graph):
        _check_tensor(tensor)
    _check_declared("input", graph.input, input_shape)
    _check_declared("output", graph.output, output_shape)
    _check_by_onnx(model)
    shapes = _inferred_shapes(model)
    _check_sizes(graph, shapes)
    if shapes[graph.output[0].name] != output_shape:
        raise GraphProblem(
            f"its network gives {_in_words(shapes[graph.output[0].name])} numbers, and by its description "
            f"{_in_words(output_shape)}"
        )


def _check_versions(model: ModelProto) -> None:
    export = f"Export it with an opset from {OPSETS[0]} to {OPSETS[-1]}"
    if model.ir_version not in IR_VERSIONS:
        age = "old" if model.ir_version < IR_VERSIONS[0] else "new"
        raise GraphProblem(
            f"its version of ONNX is too {age}: IR {model.ir_version}, not {IR_VERSIONS[0]} to "
            f"{IR_VERSIONS[-1]}",
            export,
        )
    foreign = [each.domain for each in model.opset_import if each.domain not in _STANDARD_DOMAINS]
    if foreign:
        raise GraphProblem(f"it needs operators that are not ONNX's own: those of {foreign[0]!r}")
    versions = [each.version for each in model.opset_import]
    if len(versions) != 1:
        raise GraphProblem("it does not say which version of ONNX's operators it needs, or says it twice")
    if versions[0] not in OPSETS:
        age = "old" if versions[0] < OPSETS[0] else "new"
        raise GraphProblem(
            f"its operators are too {age}: opset {versions[0]}, not {OPSETS[0]} to {OPSETS[-1]}", export
        )


def _check_node(node: NodeProto) -> None:
    if node.domain not in _STANDARD_DOMAINS or node.op_type not in OPERATORS:
        raise GraphProblem(f"its network uses {node.op_type!r}, which the networks of this program do not")
    if len(node.output) != 1:
        raise GraphProblem(f"a {node.op_type} in its network gives {len(node.output)} values, not one")
    if len({attribute.name for attribute in node.attribute}) < len(node.attribute):
        raise GraphProblem(f"a {node.op_type} in its network has an attribute twice")
    numbers: dict[str, list[int]] = {}
    for attribute in node.attribute:
        where = f"{attribute.name!r} of a {node.op_type} in its network"
        if attribute.type not in _PLAIN_ATTRIBUTES or attribute.ref_attr_name or attribute.graphs:
            raise GraphProblem(f"{where} is no plain value")
        if attribute.HasField("g") or attribute.HasField("sparse_tensor") or attribute.sparse_tensors:
            raise GraphProblem(f"{where} holds more than a plain value")
        if not all(map(math.isfinite, (attribute.f, *attribute.floats))):
            raise GraphProblem(f"{where} is not a finite number")
        integers = [attribute.i, *attribute.ints]
        if any(abs(value) > _LARGEST_INTEGER for value in integers) or len(integers) > _LONGEST_INTEGERS:
            raise GraphProblem(f"{where} is absurdly large")
        numbers[attribute.name] = list(attribute.ints) or [attribute.i]
        least = 1 if attribute.name in _FROM_ONE else 0 if attribute.name in _FROM_ZERO else None
        if least is not None and min(numbers[attribute.name]) < least:
            raise GraphProblem(f"{where} is less than {least}")
    if node.op_type == "Cast" and numbers.get("to") != [TensorProto.FLOAT]:
        raise GraphProblem("a Cast in its network does not give 32-bit floats")
    if numbers.get("training_mode", [0]) != [0]:
        raise GraphProblem("its network was exported for training", "Export it for evaluation")
    _check_padding(node, numbers)


def _check_padding(node: NodeProto, numbers: dict[str, list[int]]) -> None:
    """Refuse padding beyond what a kernel reaches, which might be laid out in memory."""
    pads, kernel = numbers.get("pads"), numbers.get("kernel_shape")
    if pads is None or node.op_type == "Pad":
        return
    if kernel is None:
        raise GraphProblem(f"a {node.op_type} in its network does not say its kernel's shape")
    dilations = numbers.get("dilations", [1] * len(kernel))
    if len(pads) != 2 * len(kernel) or len(dilations) != len(kernel):
        raise GraphProblem(f"a {node.op_type} in its network has another number of paddings than of axes")
    reach = [step * (size - 1) for step, size in zip(dilations, kernel, strict=True)]
    if any(pad > most for pad, most in zip(pads, reach * 2, strict=True)):
        raise GraphProblem(f"a {node.op_type} in its network has more padding than its kernel reaches")


def _tensors(graph: GraphProto) -> Iterator[TensorProto]:
    yield from graph.initializer
    for node in graph.node:
        for attribute in node.attribute:
            if attribute.HasField("t"):
                yield attribute.t
            yield from attribute.tensors


def _check_tensor(tensor: TensorProto) -> None:
    where = f"the tensor {tensor.name!r}"
    if tensor.data_location == TensorProto.EXTERNAL or tensor.external_data:
        raise GraphProblem(
            f"{where} lies in another file, and a checkpoint is one file", "Export it with its weights inside"
        )
    item_bytes = _ITEM_BYTES.get(tensor.data_type)
    if item_bytes is None:
        name = (
            TensorProto.DataType.Name(tensor.data_type)
            if tensor.data_type in TensorProto.DataType.values()
            else f"type {tensor.data_type}"
        )
        raise GraphProblem(f"{where} holds {name}, not FLOAT, FLOAT16 or INT64")
    if len(tensor.dims) > _MOST_AXES or any(size < 0 for size in tensor.dims) or tensor.HasField("segment"):
        raise GraphProblem(f"{where} has an impossible shape")
    is_float = tensor.data_type != TensorProto.INT64
    # Half precision has no list of its own here, and is always raw.
    typed = len(tensor.float_data) + len(tensor.int64_data)
    held = len(tensor.raw_data) // item_bytes if tensor.raw_data else typed
    if math.prod(tensor.dims) != held or len(tensor.raw_data) % item_bytes:
        raise GraphProblem(f"{where} holds {held} numbers, and by its shape {math.prod(tensor.dims)}")
    values = numpy_helper.to_array(tensor)
    if is_float:
        if not np.isfinite(values).all():
            raise GraphProblem(f"{where} holds numbers that are not finite", "The training may have failed")
    elif values.size > _LONGEST_INTEGERS or (values.size and not _are_small(values)):
        raise GraphProblem(f"{where} asks for absurd sizes")


def _are_small(values: np.ndarray) -> bool:
    # Compared without abs: the smallest integer has no positive counterpart.
    return bool((values <= _LARGEST_INTEGER).all() and (values >= -_LARGEST_INTEGER).all())


def _check_declared(what: str, values: Sequence[ValueInfoProto], shape: Shape) -> None:
    if len(values) != 1:
        raise GraphProblem(f"its network has {len(values)} {what}s, not one")
    kind = values[0].type.tensor_type
    found = _static_shape(values[0])
    if kind.elem_type != TensorProto.FLOAT:
        raise GraphProblem(f"its network's {what} is not of 32-bit floating-point numbers")
    if found != shape:
        said = "no fixed shape" if found is None else f"the shape {_in_words(found)}"
        raise GraphProblem(f"its network's {what} has {said}, and by its description {_in_words(shape)}")


def _static_shape(value: ValueInfoProto) -> Shape | None:
    kind = value.type.tensor_type
    if not kind.HasField("shape") or not all(size.HasField("dim_value") for size in kind.shape.dim):
        return None
    return tuple(size.dim_value for size in kind.shape.dim)


def _check_by_onnx(model: ModelProto) -> None:
    try:
        onnx.checker.check_model(model, full_check=True)
    except (
        onnx.checker.ValidationError,
        onnx.shape_inference.InferenceError,
        RuntimeError,
        ValueError,
        TypeError,
    ) as error:
        raise GraphProblem(f"its network is not valid ONNX ({_first_line(error)})") from error


def _inferred_shapes(model: ModelProto) -> dict[str, Shape]:
    """Return the shapes of all values by name, worked out anew: what the file says of them does not count."""
    bare = ModelProto()
    bare.CopyFrom(model)
    del bare.graph.value_info[:]
    for value in bare.graph.output:
        value.type.tensor_type.ClearField("shape")
    try:
        inferred = onnx.shape_inference.infer_shapes(bare, check_type=True, strict_mode=True, data_prop=True)
    except (onnx.shape_inference.InferenceError, RuntimeError, ValueError, TypeError) as error:
        raise GraphProblem(f"the sizes in its network do not fit ({_first_line(error)})") from error
    graph = inferred.graph
    kinds = {value.name: value for value in (*graph.value_info, *graph.input, *graph.output)}
    shapes: dict[str, Shape] = {tensor.name: tuple(tensor.dims) for tensor in graph.initializer}
    shapes[graph.input[0].name] = _static_shape(graph.input[0]) or ()
    for node in graph.node:
        value = kinds.get(node.output[0])
        shape = None if value is None else _static_shape(value)
        if value is None or shape is None or len(shape) > _MOST_AXES or any(size < 1 for size in shape):
            raise GraphProblem(f"what a {node.op_type} in its network gives has no size that is known before")
        kind = value.type.tensor_type.elem_type
        # Sizes are whole numbers, and are only handed on as they stand.
        if kind != TensorProto.FLOAT and (kind, node.op_type) != (TensorProto.INT64, "Constant"):
            raise GraphProblem(
                f"a {node.op_type} in its network computes with other numbers than 32-bit floats"
            )
        shapes[node.output[0]] = shape
    return shapes


def _check_sizes(graph: GraphProto, shapes: dict[str, Shape]) -> None:
    held = sum(4 * math.prod(shapes[node.output[0]]) for node in graph.node)
    if held > _MOST_BYTES:
        raise GraphProblem(f"its network would need {held / 2**30:,.1f} GiB, more than any of this program's")
    if (products := sum(_products(node, shapes) for node in graph.node)) > _MOST_PRODUCTS:
        raise GraphProblem(f"its network would need {products:.1e} multiplications, and take minutes")


def _products(node: NodeProto, shapes: dict[str, Shape]) -> int:
    """Return about how many multiplications, or comparisons of a pooling, a node does."""
    given = math.prod(shapes[node.output[0]])
    match node.op_type:
        case "Conv":
            return given * math.prod(shapes[node.input[1]][1:])
        case "ConvTranspose":
            return math.prod(shapes[node.input[0]]) * math.prod(shapes[node.input[1]][1:])
        case "MatMul" | "Gemm":
            return given * max(shapes[node.input[0]], default=1)
        case "MaxPool" | "AveragePool":
            kernel: Iterable[int] = next(each.ints for each in node.attribute if each.name == "kernel_shape")
            return given * math.prod(kernel)
        case _:
            return given


def _in_words(shape: Shape) -> str:
    return " × ".join(map(str, shape))


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0].rstrip(".") if lines else type(error).__name__
