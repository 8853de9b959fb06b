//! Constants that no stable solid has.

use std::borrow::Cow;

/// A material that the solver cannot use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("material: `{field}` is {value}; it must be {wanted}")]
pub struct MaterialError {
    pub field: Cow<'static, str>,
    pub value: f64,
    pub wanted: Cow<'static, str>,
}

impl MaterialError {
    /// That a constant is not admitted.
    pub(crate) fn some(
        field: impl Into<Cow<'static, str>>,
        value: f64,
        wanted: impl Into<Cow<'static, str>>,
    ) -> Option<Self> {
        Some(Self {
            field: field.into(),
            value,
            wanted: wanted.into(),
        })
    }
}
