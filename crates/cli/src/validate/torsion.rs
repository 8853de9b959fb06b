//! Torsion of a solid cylinder of incompressible material in closed form (Rivlin, Phil. Trans. R. Soc. A 242, 1949, 173-195, for any isotropic law).
//!
//! At radius `r` a twist `psi` a length is a simple shear `g = psi r` of the planes across the axis, stretches `l`, `1/l` and 1 along the radius. With
//! principal Cauchy stresses `f1`, `f2`, `f3` but for a pressure, and `cos² = l²/(l² + 1)` of the first with the circle:
//! `s_tz = (f1 - f2) / (l + 1/l)`, `s_tt - s_rr = f1 cos² + f2 sin² - f3`, `s_zz - s_rr = f1 sin² + f2 cos² - f3`, and balance along the radius gives
//! `s_rr = -int_r^R (s_tt - s_rr) / r dr`. Torque and normal force are sums over the section.

use elements::Ogden;

/// Steps along the radius.
const STEPS: usize = 4000;

/// Torque (mN mm) and normal force (mN, negative: the cylinder pushes its ends apart) of a radius (mm) at a twist (1/mm).
pub fn torsion(law: &Ogden, radius: f64, twist: f64) -> [f64; 2] {
    let step = radius / STEPS as f64;
    let (mut torque, mut normal, mut radial) = (0.0, 0.0, 0.0);
    // From the free side inward; stresses in Pa are 1e-3 mN/mm².
    for k in (0..STEPS).rev() {
        let r = (k as f64 + 0.5) * step;
        let g = twist * r;
        let l = 0.5 * g + (0.25 * g * g + 1.0).sqrt();
        let (f1, f2, f3) = (law.pull(l.ln()), law.pull(-l.ln()), law.pull(0.0));
        let square = l * l / (l * l + 1.0);
        let hoop = f1 * square + f2 * (1.0 - square) - f3;
        let axial = f1 * (1.0 - square) + f2 * square - f3;
        let half = 0.5 * hoop / r * step;
        radial -= half;
        let ring = 2e-3 * std::f64::consts::PI * r * step;
        torque += ring * r * (f1 - f2) / (l + 1.0 / l);
        normal += ring * (axial + radial);
        radial -= half;
    }
    [torque, normal]
}

#[cfg(test)]
mod tests {
    use super::torsion;
    use elements::Ogden;

    /// Neo-Hookean: `T = pi mu psi R⁴ / 2`, `N = -pi mu psi² R⁴ / 4`.
    #[test]
    fn neo_hookean_torsion_is_rivlins() {
        let law = Ogden::new(&[[1000.0, 2.0]]).unwrap();
        let (radius, twist) = (5.0f64, 0.06f64);
        let [torque, normal] = torsion(&law, radius, twist);
        let unit = 1e-3 * std::f64::consts::PI * 1000.0 * radius.powi(4);
        assert!((torque / (0.5 * unit * twist) - 1.0).abs() < 1e-6);
        assert!(
            (normal / (-0.25 * unit * twist * twist) - 1.0).abs() < 1e-3,
            "{normal}"
        );
    }
}
