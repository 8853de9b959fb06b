"""C#: what the Unity package's components and its interface show to scripts."""

from __future__ import annotations

import re

import curly
from page import ROOT, Call, Chapter, Field, Page, Section

FOLDER = ROOT / "unity-plugin/Runtime"
ABOUT = """\
The [Unity package](../../unity-plugin/Documentation~/index.md) has components, which need no script, and below them
the library's own calls for hosts that want more. Lengths of components are Unity's unless a name or a text says mm.
A failed call of `Upt.Interop` throws `UptException`; a component writes the error to the console and stops.

This page is made of the sources' comments and tooltips by `cargo xtask api`."""
COMPONENTS = "Fields in small letters are in the inspector, with the same texts."
INTEROP = "Structs with names in small letters, such as `upt_scene_options`, and `Native` are [the C ABI](abi.md)."


def page() -> Page:
    """The page of C#."""
    chapters = [
        Chapter("Components", f"Namespace `Upt`. {COMPONENTS}", sections("Components", "SoftTissue")),
        Chapter("The library", f"Namespace `Upt.Interop`. {INTEROP}", sections("Interop", "Library")),
    ]
    return Page("csharp.md", "C#", ABOUT, "csharp", chapters)


def sections(folder: str, first: str) -> list[Section]:
    """The public types of a folder, the most important first."""
    found: dict[str, Section] = {}
    for file in sorted((FOLDER / folder).glob("*.cs"), key=lambda one: (one.name.partition(".")[0], len(one.name))):
        if file.name.endswith(".g.cs"):
            continue
        for space in curly.items(file.read_text(encoding="utf-8")):
            if space.head.startswith("namespace"):
                for item in curly.items(space.body or ""):
                    add(found, item)
    return sorted(found.values(), key=lambda one: (one.name != first, one.name))


def add(found: dict[str, Section], item: curly.Item) -> None:
    """A type; the parts of a partial class become one."""
    _, head = curly.without_attributes(item.head)
    kind = re.match(r"public (?:abstract |sealed |static |unsafe |partial |readonly )*(class|struct|enum) (\w+)", head)
    if not kind:
        return
    one = found.setdefault(kind[2], Section(kind[2]))
    one.doc = one.doc or doc(item.doc)
    one.code = one.code or re.sub(r"\b(unsafe|partial) ", "", head)
    if kind[1] == "enum":
        one.word = "value"
        for value in curly.items(item.body or "", comma=True):
            _, name = curly.without_attributes(value.head)
            one.fields.append(Field(name.partition(" ")[0], "", doc(value.doc)))
        return
    for member in curly.items(item.body or ""):
        add_member(one, member)


def add_member(one: Section, member: curly.Item) -> None:
    """A public method, field or property."""
    attributes, head = curly.without_attributes(member.head)
    if not head.startswith("public ") or re.search(r"\b(override|class|struct|enum|operator)\b", head):
        return
    head = re.sub(r" => .*", "", head)
    told = doc(member.doc) or " ".join(re.findall(r'"((?:\\.|[^"\\])*)"', attributes.partition("Tooltip(")[2]))
    shown = re.sub(r"^public |\b(unsafe|readonly|virtual|abstract|const|static readonly) ", "", head)
    name = re.match(r"(?:[\w<>\[\],.* ]+ )?(\w+) ?\(", shown)
    if name and not re.match(r"[^(]*=|static \(|\(", shown):
        shown = re.sub(r" : (this|base)\(.*", "", shown)
        one.calls.append(Call(name[1], shown + ";", told))
        return
    field = re.match(r"(?:static )?(\(.*?\)|[\w<>\[\],.* ]+?) (\w+)(?: =.*)?$", shown)
    one.fields.append(Field(field[2], field[1], told))


def doc(lines: list[str]) -> str:
    """A comment of C# in Markdown."""
    text = "\n".join(lines).replace("<summary>", "").replace("</summary>", "").strip()
    text = re.sub(r'<(?:see cref|paramref name|typeparamref name)="(?:\w:)?([^"]*)"\s*/>', r"`\1`", text)
    text = re.sub(r"</?c>", "`", text)
    text = re.sub(r'<param name="(\w+)">(.*?)</param>', r"\n- `\1`: \2", text, flags=re.DOTALL)
    text = re.sub(r"<returns>(.*?)</returns>", r"\n\nReturns \1", text, flags=re.DOTALL)
    for entity, character in (("&gt;", ">"), ("&amp;", "&")):
        text = text.replace(entity, character)
    return "\n".join(line.strip() for line in text.splitlines())
