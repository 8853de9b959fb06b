"""C++: what `include/upt.hpp` declares."""

from __future__ import annotations

import re

import curly
from page import ROOT, Call, Chapter, Field, Page, Section, plain

ABOUT = """\
Header only, C++17: `#include <upt.hpp>` and link `upt` ([C and C++](../guide/c.md)). Every handle is move-only and
frees itself. A call returns `upt_status`; a negative one is thrown as `upt::error`, unless `UPT_NO_EXCEPTIONS` is
defined, which leaves out the forms that return a value. Thread rules, statuses and the fields of structs are those
of [the C ABI](abi.md).

This page is made of the header's comments by `cargo xtask api`."""


def page() -> Page:
    """The page of C++."""
    text = (ROOT / "include/upt.hpp").read_text(encoding="utf-8")
    space = next(one for one in curly.items(text) if one.head == "namespace upt")
    functions = Section("Functions", "Making structs and instruments, and the library as a whole.")
    names = Section("Names", "Structs of the C ABI, whose names the namespace has too.", word="name")
    classes: list[Section] = []
    for item in curly.items(space.body or ""):
        if alias := re.fullmatch(r"using (\w+) = (\w+)", item.head):
            names.fields.append(Field(alias[1], "", f"[`{alias[2]}`](abi.md#{alias[2]})"))
        elif item.head.startswith("namespace "):
            continue
        elif found := re.fullmatch(r"(template <.*> )?(class|struct) (\w+)( : public [\w:]+)?", item.head):
            classes.append(section(found[3], found[2] == "struct", item))
        else:
            functions.calls.append(call(item))
    classes.sort(key=lambda one: one.name in ("span", "error"))
    sections = [*classes, functions, names]
    return Page("cpp.md", "C++", ABOUT, "cpp", [Chapter("Namespace `upt`", "", sections)])


def section(name: str, is_public: bool, item: curly.Item) -> Section:
    """The public members of a class."""
    made = Section(name, plain(item.doc))
    for member in curly.items(item.body or ""):
        if member.head in curly.LABELS:
            is_public = member.head == "public"
        elif not is_public or is_silent(name, member):
            continue
        elif "(" in member.head:
            made.calls.append(call(member))
        else:
            kind, field = re.fullmatch(r"(.+?) ?(\w+)(?: = .*)?", member.head).groups()
            made.fields.append(Field(field, kind, plain(member.doc)))
    return made


def is_silent(name: str, member: curly.Item) -> bool:
    """What every handle has: it is made empty, moved, not copied, and destroyed."""
    if re.search(r"= (default|delete)$", member.head) or member.head.startswith("~"):
        return True
    return not member.doc and bool(re.search(rf"\b{name} ?\({name} &&|operator=|^{name}\(\) noexcept$", member.head))


def call(item: curly.Item) -> Call:
    """A function, as one writes it."""
    head = re.sub(r"\b(inline|constexpr|static constexpr) ", "", item.head)
    head = re.sub(r"^template <(.*?), typename = std::enable_if_t<.*>> (?=[\w:]+ ?\()", r"template <\1> ", head)
    close = closing(head, head.index("("))
    if head[close + 1 : close + 2] == "(":  # operator()
        close = closing(head, close + 1)
    head = head[: close + 1] + re.sub(r" : .*", "", head[close + 1 :])
    name = re.search(r"(operator ?[^\s(]+|[\w~]+) ?\(", re.sub(r"^template <.*?> ", "", head))[1]
    return Call(name, head + ";", plain(item.doc))


def closing(text: str, at: int) -> int:
    """Where the parenthesis that opens there is closed."""
    depth = 0
    for place in range(at, len(text)):
        depth += (text[place] == "(") - (text[place] == ")")
        if depth == 0:
            return place
    raise ValueError(f"no closing parenthesis: {text}")
