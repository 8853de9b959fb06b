"""GDScript: the methods and properties that `examples/godot` registers with the engine."""

from __future__ import annotations

import re

import curly
from page import ROOT, Call, Chapter, Field, Page, Section, plain

ABOUT = """\
`SoftTissue3D` is a `MeshInstance3D` of a GDExtension, for Godot 4.3 or newer
([`examples/godot`](../../examples/godot)). Positions and rotations are in Godot's own axes and metres, sizes of
tools in mm. A call that fails returns `false` or 0, and `message()` says why. The script that shows all of it is
[`pushed_brain.gd`](../../examples/godot/pushed_brain.gd).

This page is made of what the extension registers, by `cargo xtask api`."""

KINDS = {"NIL": "void", "BOOL": "bool", "INT": "int", "FLOAT": "float", "STRING": "String"}
METHOD = re.compile(r'\{"(\w+)",\s*(\w+),\s*T\((\w+)\),\s*\d+,\s*\{((?:\s*\{"\w+", T\(\w+\)\},?)*)\}\}')
PROPERTY = re.compile(r'\{"(\w+)",\s*T\((\w+)\),\s*"([^"]*)",\s*"(\w+)",\s*"(\w+)"\}')


def page() -> Page:
    """The page of GDScript."""
    files = sorted((ROOT / "examples/godot").glob("*.cpp"))
    texts = [file.read_text(encoding="utf-8") for file in files]
    docs = {
        name[1]: plain(item.doc)
        for text in texts
        for item in curly.items(text)
        if (name := re.match(r"(?:static )?[\w]+ (\w+)\(void \*", item.head))
    }
    registered = next(text for text in texts if "GodotMethod METHODS[]" in text)
    made = Section("SoftTissue3D", docs["create_instance"], "extends MeshInstance3D", word="property")
    hidden = set()
    setters = {name: function for name, function, _, _ in METHOD.findall(registered)}
    for name, kind, _, setter, getter in PROPERTY.findall(registered):
        made.fields.append(Field(name, typed(kind), docs[setters[setter]]))
        hidden |= {setter, getter}
    for name, function, result, arguments in METHOD.findall(registered):
        if name in hidden:
            continue
        given = ", ".join(f"{one}: {typed(kind)}" for one, kind in re.findall(r'\{"(\w+)", T\((\w+)\)\}', arguments))
        made.calls.append(Call(name, f"func {name}({given}) -> {typed(result)}", docs.get(function, "")))
    return Page("gdscript.md", "GDScript", ABOUT, "gdscript", [Chapter("SoftTissue3D", "", [made])])


def typed(variant: str) -> str:
    """GDScript's name of a variant's type."""
    return KINDS.get(variant) or "".join(word.capitalize() for word in variant.split("_"))
