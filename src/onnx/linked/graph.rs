//! Whether a graph has what a stage binds to it.
//!
//! The check comes between making a session and binding: a binding takes any tensor, and a wrong
//! one fails in the first run, far from the file whose fault it is. A dimension that the graph
//! leaves open (negative in ONNX Runtime's answer) fits every size; a fixed one must be the
//! stage's.

use ort::session::Session;
use ort::value::{Outlet, TensorElementType, ValueType};

use crate::error::{Error, Result};
use crate::onnx::Tensors;

impl Tensors<'_> {
    /// Names and shapes of all, as text.
    ///
    /// The values of constants are left out: an engine depends on what their shapes are, not on
    /// what they hold.
    pub(super) fn shapes(&self) -> String {
        let constants: Vec<_> = self.constants.iter().map(|c| (c.0, c.1)).collect();
        let indices: Vec<_> = self.indices.iter().map(|c| (c.0, c.1)).collect();
        format!(
            "{:?}{constants:?}{indices:?}{:?}",
            self.inputs, self.outputs
        )
    }

    /// Compares with the graph of a session that was made of `file`.
    pub(super) fn check(&self, file: &str, session: &Session) -> Result<()> {
        let (inputs, float) = (session.inputs(), TensorElementType::Float32);
        for (name, shape) in self.inputs {
            find(file, "input", inputs, name, shape, float)?;
        }
        for (name, shape, _) in self.constants {
            find(file, "input", inputs, name, shape, float)?;
        }
        for (name, shape, _) in self.indices {
            find(file, "input", inputs, name, shape, TensorElementType::Int64)?;
        }
        for (name, shape) in self.outputs {
            find(file, "output", session.outputs(), name, shape, float)?;
        }
        // All that a stage binds was found, so that one input more is one that nothing would fill.
        let count = self.inputs.len() + self.constants.len() + self.indices.len();
        if inputs.len() != count {
            let names: Vec<&str> = inputs.iter().map(Outlet::name).collect();
            return Err(Error::bundle(
                file,
                format!("the graph has inputs {names:?}, must have {count}"),
            ));
        }
        Ok(())
    }
}

/// Looks for one input or output by its name, with its element type and shape.
fn find(
    file: &str,
    what: &str,
    have: &[Outlet],
    name: &str,
    shape: &[usize],
    element: TensorElementType,
) -> Result<()> {
    let Some(outlet) = have.iter().find(|outlet| outlet.name() == name) else {
        let names: Vec<&str> = have.iter().map(Outlet::name).collect();
        return Err(Error::bundle(
            file,
            format!("{what} `{name}` is missing, the graph has {names:?}"),
        ));
    };
    let ValueType::Tensor {
        ty,
        shape: declared,
        ..
    } = outlet.dtype()
    else {
        return Err(Error::bundle(
            file,
            format!("{what} `{name}` is not a tensor"),
        ));
    };
    if *ty != element {
        let element = format!("{element:?}").to_lowercase();
        return Err(Error::bundle(
            file,
            format!("{what} `{name}` has type {ty:?}, must be {element}"),
        ));
    }
    let fits = declared.len() == shape.len()
        && declared
            .iter()
            .zip(shape.iter())
            .all(|(&have, &want)| have < 0 || have == want as i64);
    if !fits {
        return Err(Error::bundle(
            file,
            format!("{what} `{name}` has shape {declared:?}, must hold {shape:?}"),
        ));
    }
    Ok(())
}
