"""The few elements of a scene file that everything else is written with."""

from xml.etree import ElementTree


def number(value):
    """Nine digits tell any two floats apart."""
    text = "%.9g" % value
    return "0" if text == "-0" else text


def numbers(values):
    return ", ".join(number(value) for value in values)


def plugin(tag, kind, identifier=None, name=None):
    element = ElementTree.Element(tag, type=kind)
    if identifier:
        element.set("id", identifier)
    if name:
        element.set("name", name)
    return element


def add(parent, tag, name, value):
    """<tag name value/>, with the value's text by its type."""
    if isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, (int, str)):
        text = str(value)
    elif isinstance(value, float):
        text = number(value)
    else:
        text = numbers(value)
    return ElementTree.SubElement(parent, tag, name=name, value=text)


def add_matrix(parent, matrix, name="to_world"):
    """`matrix`: rows of a 3x3 or 4x4."""
    transform = ElementTree.SubElement(parent, "transform", name=name)
    ElementTree.SubElement(transform, "matrix", value=" ".join(number(x) for row in matrix for x in row))


def add_ref(parent, identifier, name=None):
    ref = ElementTree.SubElement(parent, "ref", id=identifier)
    if name:
        ref.set("name", name)


def comment(lines):
    """A comment can't hold two hyphens in a row, nor end with one."""
    text = "\n".join(" " * 5 + line for line in lines)
    while "--" in text:
        text = text.replace("--", "- -")
    return ElementTree.Comment("\n" + text + "\n" + " " * 5)


def write(root, path):
    ElementTree.indent(root, "    ")
    with open(path, "w", encoding="utf-8") as file:
        file.write('<?xml version="1.0" encoding="utf-8"?>\n')
        file.write(ElementTree.tostring(root, encoding="unicode"))
        file.write("\n")
