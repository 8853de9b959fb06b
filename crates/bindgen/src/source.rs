//! Reads `src/ffi/`: constants, structs and functions with their doc comments.

use std::path::Path;

use anyhow::{Context, Result, bail};
use syn::{Attribute, Expr, FnArg, Item, Lit, Pat, ReturnType, Type};

/// Where the C ABI is written.
pub const FOLDER: &str = "src/ffi";

/// The files with exported items, in the order of the header.
pub const FILES: [&str; 22] = [
    "../../crates/field/src/status.rs",
    "constants.rs",
    "structs.rs",
    "step_structs.rs",
    "load_structs.rs",
    "support_structs.rs",
    "library.rs",
    "model.rs",
    "locate.rs",
    "scene.rs",
    "worker.rs",
    "region.rs",
    "points.rs",
    "driven.rs",
    "ties.rs",
    "cut.rs",
    "surface.rs",
    "present.rs",
    "haptics.rs",
    "instrument.rs",
    "state.rs",
    "record.rs",
];

/// A doc comment's lines.
pub type Doc = Vec<String>;

/// `pub type NAME = i32;`, whose values are the constants of this type.
pub struct Enumeration {
    pub doc: Doc,
    pub name: String,
    /// The Rust name of its integer.
    pub number: String,
}

/// `pub const NAME: TYPE = VALUE;`
pub struct Constant {
    pub doc: Doc,
    pub name: String,
    /// The enumeration that it is one of.
    pub of: Option<String>,
    pub unsigned: bool,
    pub value: String,
}

/// A type that can cross the boundary.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// A number: its Rust name.
    Number(String),
    /// `c_char`, `c_void` or a struct by name.
    Named(String),
    /// A pointer, and whether it points to `const`.
    Pointer(Box<Kind>, bool),
    /// A fixed array.
    Array(Box<Kind>, usize),
}

/// A field or a parameter.
pub struct Named {
    pub doc: Doc,
    pub name: String,
    pub kind: Kind,
    /// The enumeration that its numbers are of.
    pub of: Option<String>,
}

/// A `repr(C)` struct.
pub struct Struct {
    pub doc: Doc,
    pub name: String,
    pub fields: Vec<Named>,
}

/// An exported function.
pub struct Function {
    /// Its file in `src/ffi/`.
    pub file: &'static str,
    pub doc: Doc,
    pub name: String,
    pub parameters: Vec<Named>,
    pub result: Option<Kind>,
    /// The enumeration that its result is one of.
    pub result_of: Option<String>,
}

/// The whole ABI.
#[derive(Default)]
pub struct Source {
    pub enumerations: Vec<Enumeration>,
    pub constants: Vec<Constant>,
    pub opaque: Vec<String>,
    pub structs: Vec<Struct>,
    pub functions: Vec<Function>,
}

/// Parses the files of the ABI.
pub fn read(root: &Path) -> Result<Source> {
    let mut source = Source::default();
    for name in FILES {
        let path = root.join(FOLDER).join(name);
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let file = syn::parse_file(&text).with_context(|| path.display().to_string())?;
        for item in &file.items {
            source
                .add(name, item)
                .with_context(|| path.display().to_string())?;
        }
    }
    Ok(source)
}

impl Source {
    fn add(&mut self, file: &'static str, item: &Item) -> Result<()> {
        match item {
            Item::Type(item) if is_public(&item.vis) => {
                if let Ok(Kind::Number(number)) = self.kind(&item.ty) {
                    self.enumerations.push(Enumeration {
                        doc: doc(&item.attrs),
                        name: item.ident.to_string(),
                        number,
                    });
                }
            }
            Item::Const(item) if is_public(&item.vis) => {
                let value = match item.expr.as_ref() {
                    Expr::Lit(literal) => integer(&literal.lit)?,
                    Expr::Unary(unary) => match unary.expr.as_ref() {
                        Expr::Lit(literal) => format!("-{}", integer(&literal.lit)?),
                        _ => bail!("{}: not an integer", item.ident),
                    },
                    _ => bail!("{}: not an integer", item.ident),
                };
                self.constants.push(Constant {
                    doc: doc(&item.attrs),
                    name: item.ident.to_string(),
                    of: self.enumeration(&item.ty),
                    unsigned: self.kind(&item.ty)? == Kind::Number("u32".into()),
                    value,
                });
            }
            Item::Struct(item) if is_public(&item.vis) && is_c(&item.attrs) => {
                let fields = item.fields.iter().map(|field| {
                    Ok(Named {
                        doc: doc(&field.attrs),
                        name: field.ident.as_ref().context("tuple struct")?.to_string(),
                        kind: self.kind(&field.ty)?,
                        of: self.enumeration(&field.ty),
                    })
                });
                self.structs.push(Struct {
                    doc: doc(&item.attrs),
                    name: item.ident.to_string(),
                    fields: fields.collect::<Result<_>>()?,
                });
            }
            Item::Struct(item) if is_public(&item.vis) => self.opaque.push(item.ident.to_string()),
            Item::Fn(item) if is_public(&item.vis) && item.sig.abi.is_some() => {
                let parameters = item.sig.inputs.iter().map(|input| {
                    let FnArg::Typed(input) = input else {
                        bail!("self in {}", item.sig.ident)
                    };
                    let Pat::Ident(name) = input.pat.as_ref() else {
                        bail!("pattern")
                    };
                    Ok(Named {
                        doc: Doc::new(),
                        name: name.ident.to_string(),
                        kind: self.kind(&input.ty)?,
                        of: self.enumeration(&input.ty),
                    })
                });
                self.functions.push(Function {
                    file,
                    doc: doc(&item.attrs),
                    name: item.sig.ident.to_string(),
                    parameters: parameters.collect::<Result<_>>()?,
                    result: match &item.sig.output {
                        ReturnType::Default => None,
                        ReturnType::Type(_, result) => Some(self.kind(result)?),
                    },
                    result_of: match &item.sig.output {
                        ReturnType::Default => None,
                        ReturnType::Type(_, result) => self.enumeration(result),
                    },
                });
            }
            _ => {}
        }
        Ok(())
    }
}

impl Source {
    /// The values of an enumeration, in their order.
    pub fn values<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Constant> {
        self.constants
            .iter()
            .filter(move |one| one.of.as_deref() == Some(name))
    }

    /// The enumeration that a type names, behind pointers and in arrays, too.
    fn enumeration(&self, ty: &Type) -> Option<String> {
        match ty {
            Type::Ptr(pointer) => self.enumeration(&pointer.elem),
            Type::Array(array) => self.enumeration(&array.elem),
            Type::Path(path) => {
                let name = path.path.segments.last()?.ident.to_string();
                self.number(&name).map(|_| name)
            }
            _ => None,
        }
    }

    /// The integer of an enumeration.
    fn number(&self, name: &str) -> Option<String> {
        let found = self.enumerations.iter().find(|one| one.name == name);
        found.map(|one| one.number.clone())
    }

    fn kind(&self, ty: &Type) -> Result<Kind> {
        Ok(match ty {
            Type::Ptr(pointer) => Kind::Pointer(
                Box::new(self.kind(&pointer.elem)?),
                pointer.mutability.is_none(),
            ),
            Type::Array(array) => {
                let Expr::Lit(length) = &array.len else {
                    bail!("array length")
                };
                Kind::Array(
                    Box::new(self.kind(&array.elem)?),
                    integer(&length.lit)?.parse()?,
                )
            }
            Type::Path(path) => {
                let name = path
                    .path
                    .segments
                    .last()
                    .context("empty path")?
                    .ident
                    .to_string();
                match (name.as_str(), self.number(&name)) {
                    (_, Some(number)) => Kind::Number(number),
                    ("u8" | "i32" | "u32" | "u64" | "f32" | "f64", _) => Kind::Number(name),
                    _ => Kind::Named(name),
                }
            }
            _ => bail!("a type that cannot cross the C ABI"),
        })
    }
}

fn is_public(visibility: &syn::Visibility) -> bool {
    matches!(visibility, syn::Visibility::Public(_))
}

/// `repr(C)`; a handle may be `repr(opaque)`.
fn is_c(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("repr")
            && attribute
                .parse_args::<syn::Path>()
                .is_ok_and(|path| path.is_ident("C"))
    })
}

fn integer(literal: &Lit) -> Result<String> {
    match literal {
        Lit::Int(value) => Ok(value.base10_digits().to_owned()),
        _ => bail!("a constant that is not an integer"),
    }
}

fn doc(attributes: &[Attribute]) -> Doc {
    let lines = attributes
        .iter()
        .filter(|attribute| attribute.path().is_ident("doc"));
    lines
        .filter_map(
            |attribute| match &attribute.meta.require_name_value().ok()?.value {
                Expr::Lit(literal) => match &literal.lit {
                    Lit::Str(text) => Some(text.value().trim().to_owned()),
                    _ => None,
                },
                _ => None,
            },
        )
        .collect()
}
