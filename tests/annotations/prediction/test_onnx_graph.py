"""What is looked at in an ONNX file before it runs."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from onnx import ModelProto, TensorProto, helper, numpy_helper

from annotations.prediction.onnx_graph import (
    IR_VERSIONS,
    OPERATORS,
    OPSETS,
    GraphProblem,
    check_model,
    metadata_text,
    parse_model,
    set_metadata,
)
from tests.annotations.prediction.tiny_networks import INPUT, OUTPUT, convolution, network

BIG = 1 << 20


def integers(name: str, values: list[int]) -> TensorProto:
    return numpy_helper.from_array(np.array(values, dtype=np.int64), name)


def floats(name: str, values: object) -> TensorProto:
    return numpy_helper.from_array(np.array(values, dtype=np.float32), name)


def check(model: ModelProto) -> None:
    check_model(parse_model(model.SerializeToString()), INPUT, OUTPUT)


def changed(change: Callable[[ModelProto], object]) -> ModelProto:
    model = network()
    change(model)
    return model


def after(operator: str, inputs: list[str], *tensors: TensorProto, **attributes: object) -> ModelProto:
    """Return a network in which a node stands between the convolution and the output."""
    node = helper.make_node(operator, ["halved", *inputs], ["heatmaps"], **attributes)
    return network([convolution("halved"), node], list(tensors))


def test_a_plain_network_is_taken() -> None:
    check(network())


@pytest.mark.parametrize("version", [IR_VERSIONS[0], IR_VERSIONS[-1]])
def test_the_oldest_and_the_newest_ir_version_are_taken(version: int) -> None:
    check(network(ir_version=version))


@pytest.mark.parametrize("version", [OPSETS[0], OPSETS[-1]])
def test_the_oldest_and_the_newest_opset_are_taken(version: int) -> None:
    check(network(opset=version))


@pytest.mark.parametrize(
    "model",
    [
        after("Add", ["one"], floats("one", np.ones((1, 2, 1, 1, 1)))),
        after("Clip", ["low"], floats("low", 0)),
        after("Relu", []),
        after("LeakyRelu", [], alpha=0.1),
        after("Softmax", [], axis=1),
        after("Identity", []),
        after("Reshape", ["size"], integers("size", [1, 2, 4, 6, -1])),
        after("Pad", ["pads"], integers("pads", [0] * 10)),
        after("Resize", ["", "scales"], floats("scales", [1, 1, 1, 1, 1]), mode="linear"),
        after(
            "BatchNormalization",
            ["ones", "ones", "ones", "ones"],
            floats("ones", np.ones(2)),
        ),
        after("MaxPool", [], kernel_shape=[3, 3, 3], pads=[1] * 6),
        after(
            "Conv",
            ["more"],
            floats("more", np.ones((2, 1, 3, 3, 3))),
            kernel_shape=[3] * 3,
            group=2,
            pads=[1] * 6,
        ),
    ],
    ids=lambda model: model.graph.node[-1].op_type,
)
def test_what_networks_are_made_of_is_taken(model: ModelProto) -> None:
    check(model)


def test_a_constant_and_a_convolution_that_doubles_are_taken() -> None:
    size = helper.make_node("Constant", [], ["size"], value_ints=[1, 2, 4, 6, 6])
    up = helper.make_node(
        "ConvTranspose", ["halved", "more"], ["doubled"], kernel_shape=[2] * 3, strides=[2] * 3
    )
    down = helper.make_node("AveragePool", ["doubled"], ["pooled"], kernel_shape=[2] * 3, strides=[2] * 3)
    reshaped = helper.make_node("Reshape", ["pooled", "size"], ["heatmaps"])
    check(
        network([size, convolution("halved"), up, down, reshaped], [floats("more", np.ones((2, 2, 2, 2, 2)))])
    )


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "empty"),
        (b"PK\x03\x04rest", "PyTorch"),
        (b"\x80\x02}q\x00.", "PyTorch"),
        (b"\x80\x04\x95.", "PyTorch"),
        (b"\x89HDF\r\n\x1a\n", "not an ONNX file"),
        (b"not at all", "not an ONNX file"),
        (network().SerializeToString()[:-40], "truncated"),
        (helper.make_tensor_value_info("x", TensorProto.FLOAT, (1,)).SerializeToString(), "not an ONNX file"),
        (network([]).SerializeToString(), "no network"),
    ],
    ids=["empty", "zip", "pickle 2", "pickle 4", "HDF5", "text", "truncated", "other protobuf", "no nodes"],
)
def test_what_is_no_onnx_is_named(content: bytes, said: str) -> None:
    with pytest.raises(GraphProblem, match=said):
        parse_model(content)


def test_a_file_of_torch_is_told_how_to_become_a_checkpoint() -> None:
    with pytest.raises(GraphProblem) as caught:
        parse_model(b"PK\x03\x04")
    assert "annotations checkpoint convert" in caught.value.remedy


def test_a_file_of_very_many_parts_is_refused() -> None:
    model = network([helper.make_node("Relu", ["x"], ["x"])] * 20_000)
    with pytest.raises(GraphProblem, match="parts"):
        parse_model(model.SerializeToString())


def test_fields_that_onnx_does_not_know_are_dropped() -> None:
    plain = network().SerializeToString()
    # Field 999, four bytes.
    assert (
        parse_model(plain + b"\xba\x3e\x04evil").SerializeToString() == parse_model(plain).SerializeToString()
    )


def test_metadata_are_found_by_their_key_and_replace_all_others() -> None:
    model = network()
    model.metadata_props.add(key="place", value="/home/somebody")
    model.graph.node[0].doc_string = "somebody's file, line 3"
    model.graph.node[0].metadata_props.add(key="stack", value="somebody's file")
    model.graph.value_info.add(name="x", doc_string="somebody")

    assert metadata_text(model, "mine") is None
    set_metadata(model, "mine", "text")

    assert metadata_text(model, "mine") == "text"
    assert b"somebody" not in model.SerializeToString()


def test_metadata_that_stand_there_twice_are_refused() -> None:
    model = network()
    for text in ("one", "two"):
        model.metadata_props.add(key="mine", value=text)
    with pytest.raises(GraphProblem, match="twice"):
        metadata_text(model, "mine")


def test_metadata_that_are_no_text_are_refused() -> None:
    model = network()
    model.metadata_props.add(key="mine", value="@@@@")
    content = model.SerializeToString().replace(b"@@@@", b"\xff\xfe\xfd\xfc")
    with pytest.raises(GraphProblem, match=r"text|not an ONNX"):
        metadata_text(parse_model(content), "mine")


def external(model: ModelProto) -> None:
    tensor = model.graph.initializer[0]
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="../../../etc/passwd")


def named_external_only(model: ModelProto) -> None:
    model.graph.initializer[0].external_data.add(key="location", value="/etc/passwd")


def local_function(model: ModelProto) -> None:
    function = helper.make_function(
        "evil",
        "Relu",
        ["x"],
        ["y"],
        [helper.make_node("Identity", ["x"], ["y"])],
        [helper.make_opsetid("", 18)],
    )
    model.functions.append(function)


def sparse(model: ModelProto) -> None:
    model.graph.sparse_initializer.add().dims.append(3)


def strings(model: ModelProto) -> None:
    model.graph.initializer.append(helper.make_tensor("words", TensorProto.STRING, [1], [b"word"]))


def doubles(model: ModelProto) -> None:
    model.graph.initializer.append(helper.make_tensor("doubles", TensorProto.DOUBLE, [1], [1.0]))


def unknown_type(model: ModelProto) -> None:
    model.graph.initializer[0].data_type = 999


def absurd_dims(model: ModelProto) -> None:
    model.graph.initializer[0].dims[0] = 1 << 60


def negative_dims(model: ModelProto) -> None:
    model.graph.initializer[0].dims[0] = -2


def odd_bytes(model: ModelProto) -> None:
    model.graph.initializer[0].raw_data += b"\0"


def segment(model: ModelProto) -> None:
    model.graph.initializer[0].segment.begin = 1


def set_weight(value: float) -> Callable[[ModelProto], None]:
    def change(model: ModelProto) -> None:
        values = numpy_helper.to_array(model.graph.initializer[0]).copy()
        values[0, 0, 0, 0, 0] = value
        model.graph.initializer[0].CopyFrom(numpy_helper.from_array(values, "weights"))

    return change


def second_output(model: ModelProto) -> None:
    model.graph.output.add().CopyFrom(model.graph.output[0])


def second_input(model: ModelProto) -> None:
    model.graph.input.append(helper.make_tensor_value_info("more", TensorProto.FLOAT, (1,)))


def no_output(model: ModelProto) -> None:
    del model.graph.output[:]


def false_output(model: ModelProto) -> None:
    model.graph.initializer[0].CopyFrom(floats("weights", np.ones((3, 1, 2, 2, 2))))


def foreign_opset(model: ModelProto) -> None:
    model.opset_import.add(domain="com.evil", version=1)


def foreign_operator(model: ModelProto) -> None:
    model.graph.node[0].domain = "com.evil"


def two_opsets(model: ModelProto) -> None:
    model.opset_import.add(domain="ai.onnx", version=19)


def no_opset(model: ModelProto) -> None:
    del model.opset_import[:]


def training(model: ModelProto) -> None:
    model.training_info.add()


def unknown_input(model: ModelProto) -> None:
    model.graph.node[0].input[0] = "nothing"


def repeated_attribute(model: ModelProto) -> None:
    model.graph.node[0].attribute.append(helper.make_attribute("strides", [1, 1, 1]))


def hidden_graph(model: ModelProto) -> None:
    attribute = model.graph.node[0].attribute[0]
    attribute.g.CopyFrom(network().graph)


def referring_attribute(model: ModelProto) -> None:
    model.graph.node[0].attribute[0].ref_attr_name = "strides"


def two_values(model: ModelProto) -> None:
    model.graph.node[0].output.append("more")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (external, "another file"),
        (named_external_only, "another file"),
        (local_function, "operators of its own"),
        (sparse, "sparse"),
        (training, "how to train"),
        (strings, "STRING"),
        (doubles, "DOUBLE"),
        (unknown_type, "999"),
        (absurd_dims, "holds 16 numbers"),
        (negative_dims, "impossible shape"),
        (odd_bytes, "holds 16 numbers"),
        (segment, "impossible shape"),
        (set_weight(np.nan), "not finite"),
        (set_weight(-np.inf), "not finite"),
        (second_output, "2 outputs"),
        (second_input, "2 inputs"),
        (no_output, "0 outputs"),
        (false_output, "not valid ONNX"),
        (foreign_opset, "com.evil"),
        (foreign_operator, "do not"),
        (two_opsets, "twice"),
        (no_opset, "does not say"),
        (unknown_input, "not valid ONNX"),
        (repeated_attribute, "twice"),
        (hidden_graph, "more than a plain value"),
        (referring_attribute, "no plain value"),
        (two_values, "2 values"),
    ],
    ids=lambda value: value.__name__ if callable(value) else None,
)
def test_what_no_network_of_ours_has_is_refused(change: Callable[[ModelProto], object], said: str) -> None:
    with pytest.raises(GraphProblem, match=re.escape(said)):
        check(changed(change))


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (network(ir_version=IR_VERSIONS[0] - 1), "too old: IR 6"),
        (network(ir_version=IR_VERSIONS[-1] + 1), "too new: IR 11"),
        (network(opset=OPSETS[0] - 1), "too old: opset 12"),
        (network(opset=OPSETS[-1] + 1), "too new: opset 23"),
        (network(kind=TensorProto.DOUBLE), "32-bit"),
        (network(input_shape=("n", *INPUT[1:])), "no fixed shape"),
        (
            network(input_shape=(1, 1, 8, 12, 14)),
            "1 × 1 × 8 × 12 × 14, and by its description 1 × 1 × 8 × 12 × 12",
        ),
        (network(output_shape=(1, 3, 4, 6, 6)), "output has the shape 1 × 3 × 4 × 6 × 6"),
    ],
    ids=["old IR", "new IR", "old opset", "new opset", "doubles", "any batch", "other input", "other output"],
)
def test_what_does_not_fit_is_refused(model: ModelProto, said: str) -> None:
    with pytest.raises(GraphProblem, match=re.escape(said)):
        check(model)


@pytest.mark.parametrize(
    "operator",
    [
        "If",
        "Loop",
        "Scan",
        "ConstantOfShape",
        "Expand",
        "Tile",
        "RandomNormal",
        "Gather",
        "Dropout",
        "Slice",
    ],
)
def test_an_operator_that_is_not_on_the_list_is_refused(operator: str) -> None:
    assert operator not in OPERATORS
    with pytest.raises(GraphProblem, match=operator):
        check(after(operator, []))


def test_a_branch_is_refused() -> None:
    branch = helper.make_graph([helper.make_node("Relu", ["volume"], ["y"])], "branch", [], [])
    node = helper.make_node("If", ["volume"], ["heatmaps"], then_branch=branch, else_branch=branch)
    with pytest.raises(GraphProblem, match="'If'"):
        check(network([node]))


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (network([convolution(strides=[0, 2, 2])]), "less than 1"),
        (network([convolution(group=0)]), "less than 1"),
        (network([convolution(dilations=[1, -1, 1])]), "less than 1"),
        (network([convolution(pads=[-1] * 6)]), "less than 0"),
        (network([convolution(pads=[BIG] * 6)]), "more padding"),
        (network([convolution(pads=[1] * 4)]), "another number of paddings"),
        (network([convolution(dilations=[1 << 40] * 3)]), "absurdly large"),
        (network([convolution(strides=[2] * 65)]), "absurdly large"),
        (after("LeakyRelu", [], alpha=float("nan")), "not a finite number"),
        (after("Reshape", ["size"], integers("size", [1 << 62, 4])), "absurd sizes"),
        (after("Reshape", ["size"], integers("size", [-(1 << 63), 4])), "absurd sizes"),
        (after("Reshape", ["size"], integers("size", [1] * 65)), "absurd sizes"),
        (after("Pad", ["pads"], integers("pads", [0] * 9 + [1 << 62])), "absurd sizes"),
        (
            after("BatchNormalization", ["o", "o", "o", "o"], floats("o", np.ones(2)), training_mode=1),
            "training",
        ),
    ],
)
def test_numbers_that_could_do_harm_never_reach_other_code(model: ModelProto, said: str) -> None:
    with pytest.raises(GraphProblem, match=said):
        check(model)


def bomb(*nodes: object, tensors: list[TensorProto]) -> ModelProto:
    """Return a network that does something huge before it gives an output of the right size."""
    end = helper.make_node("Reshape", ["huge", "size"], ["heatmaps"])
    return network([convolution("halved"), *nodes, end], [*tensors, integers("size", list(OUTPUT))])  # type: ignore[list-item]


@pytest.mark.parametrize(
    "model",
    [
        bomb(
            helper.make_node("Pad", ["halved", "pads"], ["huge"]),
            tensors=[integers("pads", [0, 0, 0, 0, 0, 0, 0, 5000, 5000, 5000])],
        ),
        bomb(
            helper.make_node("Resize", ["halved", "", "scales"], ["huge"], mode="nearest"),
            tensors=[floats("scales", [1, 1, 2000, 2000, 2000])],
        ),
        bomb(
            helper.make_node(
                "ConvTranspose", ["halved", "up"], ["huge"], kernel_shape=[1] * 3, strides=[2000] * 3
            ),
            tensors=[floats("up", np.ones((2, 1, 1, 1, 1)))],
        ),
        bomb(
            helper.make_node("Add", ["row", "column"], ["huge"]),
            tensors=[floats("row", np.ones((1, 40000))), floats("column", np.ones((40000, 1)))],
        ),
    ],
    ids=["padding", "resizing", "transposed convolution", "broadcasting"],
)
def test_a_network_that_would_fill_the_memory_is_refused(model: ModelProto) -> None:
    with pytest.raises(GraphProblem, match=r"GiB|not valid ONNX|do not fit"):
        check(model)


def test_many_values_of_ordinary_size_count_together() -> None:
    wide = helper.make_node("Resize", ["halved", "", "scales"], ["wide0"], mode="nearest")
    nodes = [helper.make_node("Relu", [f"wide{place}"], [f"wide{place + 1}"]) for place in range(400)]
    end = helper.make_node("MaxPool", ["wide400"], ["heatmaps"], kernel_shape=[20] * 3, strides=[20] * 3)
    model = network([convolution("halved"), wide, *nodes, end], [floats("scales", [1, 1, 20, 20, 20])])
    with pytest.raises(GraphProblem, match="GiB"):
        check(model)


def test_a_network_that_would_take_minutes_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    square = floats("square", np.ones((200, 200)))
    nodes = [helper.make_node("MatMul", ["square", "square"], ["p0"])]
    nodes += [helper.make_node("MatMul", [f"p{place}", "square"], [f"p{place + 1}"]) for place in range(20)]
    model = network([*nodes, convolution()], [square])
    check(model)

    monkeypatch.setattr("annotations.prediction.onnx_graph._MOST_PRODUCTS", 20 * 200**3)
    with pytest.raises(GraphProblem, match="multiplications"):
        check(model)


def test_sizes_that_the_file_claims_do_not_count() -> None:
    model = bomb(
        helper.make_node("Resize", ["halved", "", "scales"], ["huge"], mode="nearest"),
        tensors=[floats("scales", [1, 1, 2000, 2000, 2000])],
    )
    model.graph.value_info.append(helper.make_tensor_value_info("huge", TensorProto.FLOAT, OUTPUT))
    with pytest.raises(GraphProblem):
        check(model)


def test_a_size_that_is_only_known_while_it_runs_is_refused() -> None:
    # The sizes are an output of a node, which is a float here and no size.
    node = helper.make_node("Reshape", ["halved", "halved"], ["heatmaps"])
    with pytest.raises(GraphProblem):
        check(network([convolution("halved"), node]))
