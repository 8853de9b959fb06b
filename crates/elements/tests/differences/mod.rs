//! Derivatives by differences, which stresses and tangents are held against.

pub type Matrix = [[f64; 3]; 3];

/// Fourth-order difference of `of` over one entry of `F`.
pub fn slope(f: Matrix, [i, j]: [usize; 2], of: impl Fn(Matrix) -> f64) -> f64 {
    let step = 1e-4;
    let at = |k: f64| {
        let mut f = f;
        f[i][j] += k * step;
        of(f)
    };
    (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * step)
}

/// The largest absolute value.
pub fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, |a: f64, b| a.max(b.abs()))
}
