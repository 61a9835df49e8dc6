"""Every public name has a docstring that numpydoc parses, and whose parameters are those of its signature."""

import dataclasses
import enum
import importlib
import inspect
import re

import dockpose
import msgspec
import pytest

from tests.support.layout import ROOT

MODULES = (
    "dockpose",
    "dockpose.camera",
    "dockpose.estimate",
    "dockpose.thresholds",
    "dockpose.lights",
    "dockpose.pose",
    "dockpose.tracking",
    "dockpose.sources.frames",
    "dockpose.simulate",
    "dockpose.truth",
)
# What numpydoc's validation says of a docstring, less what is no fault here: sections that are optional, and the
# parameters, which classes may document as attributes.
OPTIONAL = {"ES01", "SA01", "EX01", "PR01"}
# Of a number its name, its type or its description tells the unit.
ENDINGS = ("_m", "_px", "_px2", "_deg", "_rad", "_s", "_ms", "_hz", "_levels", "_per_m")
UNIT = re.compile(
    r"metre|pixel|degree|radian|second|hertz|level|0 to 1|0\.\.1|probabilit|share|times|1 / m|fraction", re.I
)


# Plain factors, exponents and coefficients, and what the camera's own unit is of.
WITHOUT_UNIT = {"conic", "normal", "probability", "quaternion_xyzw", "quaternions_xyzw", "rotation"} | {
    "beam_exponent",
    "distortion",
    "exposure",
    "gain",
    "glass_index",
    "water_index",
}


def public():
    found = {}
    for name in MODULES:
        module = importlib.import_module(name)
        for one in module.__all__:
            value = getattr(module, one)
            if inspect.isfunction(value) or inspect.isclass(value):
                found[f"{value.__module__}.{value.__qualname__}"] = value
    return found


PUBLIC = public()


def parameters_of(text):
    from numpydoc.docscrape import NumpyDocString  # pyright: ignore[reportMissingImports]

    document = NumpyDocString(inspect.cleandoc(text or ""))
    sections = document["Parameters"] + document["Attributes"] + document["Other Parameters"]
    return {name.strip(): (one.type, " ".join(one.desc)) for one in sections for name in one.name.split(",")}


def documented(value):
    """The parameters that a docstring has, those of a class's bases included."""
    ours = [one for one in getattr(value, "__mro__", ()) if one.__module__.startswith("dockpose")]
    owners = ours[::-1] or [value]
    return {name: told for owner in owners for name, told in parameters_of(owner.__doc__).items()}


def asked_for(value):
    """The public names in the signature; of an enumeration, and of an error, which the library makes, none."""
    if inspect.isclass(value) and issubclass(value, (enum.Enum, Exception)):
        return set()
    if dataclasses.is_dataclass(value):
        return {one.name for one in dataclasses.fields(value) if one.init and not one.name.startswith("_")}
    if inspect.isclass(value) and issubclass(value, msgspec.Struct):
        return {name for name in value.__struct_fields__ if not name.startswith("_")}
    if inspect.isclass(value) and inspect.isabstract(value):
        return set()  # nobody but the library's own classes makes one
    return set(inspect.signature(value).parameters) - {"self"}


@pytest.mark.extra
@pytest.mark.parametrize("name", PUBLIC)
def test_a_docstring_is_valid_and_tells_every_parameter_its_shape_and_unit(name):
    from numpydoc.validate import validate  # pyright: ignore[reportMissingImports]

    value = PUBLIC[name]
    assert [error for error in validate(name)["errors"] if error[0] not in OPTIONAL] == []
    told = documented(value)
    assert asked_for(value) - set(told) == set()
    if inspect.isfunction(value):
        assert set(told) == asked_for(value)
    for parameter, (kind, text) in told.items():
        if re.search(r"\barray\b", kind):
            assert re.search(r"\(.*\)|as for|as it", f"{kind} {text}"), parameter
        if re.search(r"\bfloat\b", kind) and not parameter.endswith(ENDINGS):
            assert UNIT.search(f"{kind} {text}") or parameter in WITHOUT_UNIT, parameter


def test_the_page_on_python_has_every_public_name():
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"^::: \S+\.(\w+)$", page, re.MULTILINE))
    shown |= {name for names in re.findall(r"members: \[(.*?)\]", page) for name in names.split(", ")}
    names = {name for name in dockpose.__all__ if not name.startswith("_")}
    assert names | {"Board", "calibrate", "load_camera", "load_scene", "save_camera"} <= shown
