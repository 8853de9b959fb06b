"""Python: the names that the package `upt` exports, by their docstrings and signatures."""

from __future__ import annotations

import ast
import re

from page import ROOT, Call, Chapter, Field, Page, Section, plain

FOLDER = ROOT / "python/upt"
ABOUT = """\
`import upt` ([Python](../guide/python.md)). Arrays are NumPy's, float32, `[n, 3]`, mm, unless a text says
otherwise; `K` is the number of nodes. What fails raises an exception of `upt.errors` with the library's message.

This page is made of the package's docstrings by `cargo xtask api`."""

RECORDS = """\
These are made from [the C ABI](abi.md), whose names their texts use. Options are keywords of the calls that take
them; a value of an enumeration may also be its name in small letters; `None` is the ABI's NULL."""


class Package:
    """The modules of `upt`, read when they are asked for."""

    def __init__(self) -> None:
        self.trees: dict[str, ast.Module] = {}
        self.texts: dict[str, list[str]] = {}

    def tree(self, module: str) -> ast.Module:
        """A module's syntax."""
        if module not in self.trees:
            text = (FOLDER / f"{module}.py").read_text(encoding="utf-8")
            self.trees[module] = ast.parse(text)
            self.texts[module] = text.splitlines()
        return self.trees[module]

    def find(self, module: str, name: str) -> tuple[str, ast.stmt] | None:
        """Where a name of the package is defined, through its imports."""
        for node in self.tree(module).body:
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == name:
                return module, node
            if isinstance(node, ast.Assign | ast.AnnAssign) and name in targets(node):
                return module, node
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("upt."):
                for alias in node.names:
                    if (alias.asname or alias.name) == name:
                        return self.find(node.module.removeprefix("upt."), alias.name)
        return None


def targets(node: ast.Assign | ast.AnnAssign) -> list[str]:
    """The plain names that are assigned."""
    found = node.targets if isinstance(node, ast.Assign) else [node.target]
    return [one.id for one in found if isinstance(one, ast.Name)]


def page() -> Page:
    """The page of Python."""
    package = Package()
    exported = next(
        ast.literal_eval(node.value)
        for node in package.tree("__init__").body
        if isinstance(node, ast.Assign) and targets(node) == ["__all__"]
    )
    functions = Section("Functions", "Calls of the module `upt`.", word="constant")
    classes, records, errors = [], [], []
    for name in sorted(exported, key=str.lower):
        module, node = package.find("__init__", name)
        if isinstance(node, ast.FunctionDef):
            functions.calls.append(call(node))
        elif isinstance(node, ast.ClassDef):
            one = section(package, module, node)
            (errors if module == "errors" else records if module == "_native" else classes).append(one)
        else:
            functions.fields.append(Field(name, "", below(package, module, node)))
    chapters = [
        Chapter("Functions", "", [functions]),
        Chapter("Classes", "", sorted(classes, key=lambda one: (one.name not in ("Model", "Scene"), one.name))),
        Chapter("Options, readings, enumerations", RECORDS, records),
        Chapter("Errors", "", errors),
    ]
    return Page("python.md", "Python", ABOUT, "python", chapters)


def section(package: Package, module: str, node: ast.ClassDef) -> Section:
    """A class with what it has of bases that the package does not export."""
    bases = [ast.unparse(base) for base in node.bases]
    enumeration = any(base in ("IntEnum", "IntFlag") for base in bases)
    made = Section(node.name, told(node), word="value" if enumeration else "field")
    parts = [(module, node)]
    for base in bases:
        found = package.find(module, base)
        if found and found[0] not in ("_record", "errors"):
            parts.append(found)
    for at, one in parts:
        for member in one.body:
            add(package, made, at, member, enumeration)
    if module == "errors":
        made.code = f"class {node.name}({', '.join(bases)})"
    return made


def add(package: Package, made: Section, module: str, member: ast.stmt, enumeration: bool) -> None:
    """A public method or field."""
    if isinstance(member, ast.FunctionDef):
        decorators = [ast.unparse(one) for one in member.decorator_list]
        if member.name == "__init__":
            if made.name not in ("Error",) and not made.code:
                made.code = signature(member, made.name)
            made.fields += assigned(package, module, member)
        elif member.name.startswith("_") or any(one.endswith(".setter") for one in decorators):
            return
        elif "property" in decorators or "cached_property" in decorators:
            made.fields.append(Field(member.name, ast.unparse(member.returns), told(member)))
        else:
            made.calls.append(call(member, f"{made.name}." if "classmethod" in decorators else ""))
    elif (
        isinstance(member, ast.AnnAssign)
        and isinstance(member.target, ast.Name)
        or (enumeration and isinstance(member, ast.Assign))
    ):
        name = targets(member)[0]
        if name.startswith("_") or name in ("struct_size", "reserved"):
            return
        kind = "" if enumeration else ast.unparse(member.annotation)
        made.fields.append(Field(name, kind, below(package, module, member)))


def below(package: Package, module: str, node: ast.stmt) -> str:
    """The string under an assignment, or the comment `#:` above it."""
    text = package.texts[module]
    above, at = [], node.lineno - 2
    while at >= 0 and text[at].strip().startswith("#:"):
        above.insert(0, text[at].strip()[2:].strip())
        at -= 1
    if above:
        return plain(above)
    for tree in ast.walk(package.tree(module)):
        body = getattr(tree, "body", None)
        if isinstance(body, list) and node in body:
            following = body[body.index(node) + 1 :][:1]
            if following and isinstance(following[0], ast.Expr) and isinstance(following[0].value, ast.Constant):
                return plain(following[0].value.value.splitlines())
    return ""


def assigned(package: Package, module: str, init: ast.FunctionDef) -> list[Field]:
    """What `__init__` keeps for its users: `#: doc` above `self.name: type = ...`."""
    found = []
    for node in ast.walk(init):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Attribute):
            if doc := below(package, module, node):
                found.append(Field(node.target.attr, ast.unparse(node.annotation), doc))
    return found


def call(node: ast.FunctionDef, of: str = "") -> Call:
    """A function by its signature."""
    return Call(node.name, signature(node, of + node.name), told(node))


def signature(node: ast.FunctionDef, name: str) -> str:
    """As one calls it: without `self`."""
    arguments = re.sub(r"^(self|cls)(, )?", "", ast.unparse(node.args))
    arguments = arguments.replace("=", " = ")
    arguments = re.sub(r"Unpack\[(\w+)Keywords\]", r"\1", arguments)
    result = ast.unparse(node.returns) if node.returns else "None"
    return f"{name}({arguments})" + ("" if result == "None" else f" -> {result}")


def told(node: ast.ClassDef | ast.FunctionDef) -> str:
    """A docstring in Markdown: its sections `Args`, `Returns` and `Raises` as lists."""
    parts = re.split(r"^(Args|Returns|Raises|Yields):\n", ast.get_docstring(node) or "", flags=re.MULTILINE)
    text = [plain(parts[0].splitlines())]
    for word, body in zip(parts[1::2], parts[2::2], strict=True):
        indented = re.match(r"(?:(?: {4}.*)?\n?)*", body)
        lines = [line[4:] for line in indented[0].rstrip().splitlines()]
        rest = body[indented.end() :].strip()
        if word == "Returns":
            text.append(f"Returns: {plain(lines)}")
        else:
            entries = re.split(r"\n(?=[\w*.])", "\n".join(lines).strip())
            bullets = [re.sub(r"^([\w*., ]+): ", r"- `\1`: ", " ".join(entry.split())) for entry in entries]
            text.append(plain((["Raises:", ""] if word == "Raises" else []) + bullets))
        text += [plain(rest.splitlines())] if rest else []
    return "\n\n".join(text)
