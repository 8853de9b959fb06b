//! A simple shear that rises and is held: the elements' recursion by steps against another integration of the same equations.
//!
//! With `F = 1 + gamma(t) e_x e_y` the volume stays, and `S = g_inf S_iso + sum q`, `dq/dt + q / tau = g dS_iso/dt` is an ordinary differential equation
//! whose right side is known: Runge and Kutta's method of fourth order in float64, at steps that are small beside ramp and time constant, from the law's
//! stress. The elements take one step after the other in float32 ([`elements::StressHistory`]), each exact where `S_iso` rises at a constant rate.

use anyhow::{Context, Result};
use elements::{
    Branch, Deformation, ElementForces, HistoryStep, Isa, Law, Material, Ogden, Relaxation, stress,
};
use tissue::mesh::regular_box;

use super::section::{Section, verdict};

/// Largest error after 1 s and 60 s that is promised, here at every time that is looked at.
const BAR: f64 = 0.03;
const SIDE: f32 = 10.0;
/// Amount of shear, and how long it rises, s.
const SHEAR: f64 = 0.3;
const RAMP_S: f64 = 0.4;
/// Of the stress at once, what is lost.
const SHARE: f64 = 0.8;
/// Steps, s: a scene's, one of its tenth.
const STEPS_S: [f64; 2] = [0.02, 0.002];
/// Time constants over the step.
const OVER: [f64; 7] = [0.1, 0.3, 1.0, 3.0, 10.0, 100.0, 1000.0];
/// When the stress is looked at: parts of the ramp, and times of the hold over the time constant, at most [`LONGEST`] ramps.
const RISING: [f64; 2] = [0.25, 0.5];
const HELD: [f64; 3] = [0.0, 1.0, 3.0];
const LONGEST: f64 = 20.0;
/// Steps of the other integration in a ramp, and in a time constant.
const FINE: [f64; 2] = [400.0, 40.0];

type Matrix = [[f64; 3]; 3];

fn sheared(gamma: f64) -> Matrix {
    [[1.0, gamma, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
}

/// `P` of a shear.
fn elastic(material: &Material, gamma: f64) -> Matrix {
    stress(&Deformation::of(sheared(gamma)), material.moduli())
}

/// Second row of `S = F^-1 P`, of which `P_xy = S_xy + gamma S_yy`.
fn second_piola(material: &Material, gamma: f64) -> [f64; 2] {
    let p = elastic(material, gamma);
    [p[0][1] - gamma * p[1][1], p[1][1]]
}

fn amount(t: f64) -> f64 {
    SHEAR * (t / RAMP_S).min(1.0)
}

/// `P_xy` by the differential equation at some times, ascending.
fn integrated(material: &Material, branch: Branch, times: &[f64]) -> Vec<f64> {
    // dS/dt within the ramp, by a difference that is small beside the shear.
    let rate = |t: f64, k: usize| {
        if t >= RAMP_S {
            return 0.0;
        }
        let by = 1e-5;
        let of = |gamma: f64| second_piola(material, gamma)[k];
        (of(amount(t) + by) - of(amount(t) - by)) / (2.0 * by) * SHEAR / RAMP_S
    };
    let (mut t, mut q) = (0.0, [0.0; 2]);
    let mut out = Vec::new();
    let longest = (RAMP_S / FINE[0]).min(branch.tau_s / FINE[1]);
    for end in times {
        // No step goes over the end of the ramp.
        for stop in [end.min(RAMP_S), *end] {
            let count = ((stop - t) / longest).ceil().max(0.0);
            let (from, h) = (t, (stop - t) / count.max(1.0));
            for step in 0..count as usize {
                let at = from + h * step as f64;
                for (k, q) in q.iter_mut().enumerate() {
                    // Inside of the step at its end, where the rate may jump.
                    let slope = |t: f64, q: f64| branch.share * rate(t, k) - q / branch.tau_s;
                    let last = (at + h).min(at + h * (1.0 - 1e-9));
                    let a = slope(at, *q);
                    let b = slope(at + 0.5 * h, *q + 0.5 * h * a);
                    let c = slope(at + 0.5 * h, *q + 0.5 * h * b);
                    let d = slope(last, *q + h * c);
                    *q += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
                }
            }
            t = stop.max(t);
        }
        let gamma = amount(*end);
        let s = second_piola(material, gamma);
        let lasting = 1.0 - branch.share;
        let both = [0, 1].map(|k| lasting * s[k] + q[k]);
        out.push(both[0] + gamma * both[1]);
    }
    out
}

fn serial(count: usize, task: &(dyn Fn(usize, usize) + Sync)) {
    (0..count).for_each(|chunk| task(chunk, 0));
}

/// The same by the elements, step by step.
fn stepped(material: &Material, step_s: f64, times: &[f64]) -> Result<Vec<f64>> {
    let mesh = regular_box([SIDE; 3], [1; 3])?;
    let soft = material.in_steps_of(step_s);
    let forces = ElementForces::new(mesh.tetrahedra(), &soft, Isa::detect())?;
    let mut scratch = forces.scratch(1)?;
    let mut history = forces.stress_history()?.context("a relaxing material")?;
    let step = HistoryStep {
        since_s: step_s,
        times_s: [0.0, step_s],
        g0: material.relaxation.over(step_s),
    };
    let numbers = 3 * mesh.positions.len();
    let (mut own, mut kept) = (vec![0.0; numbers], vec![0.0; numbers]);
    let mut out = Vec::new();
    let mut done = 0;
    for time in times {
        let count = (time / step_s).round() as usize;
        while done < count {
            done += 1;
            let gamma = amount(done as f64 * step_s);
            let moved = mesh.positions.iter();
            let u: Vec<f32> = moved
                .flat_map(|p| [(gamma * f64::from(p[1])) as f32, 0.0, 0.0])
                .collect();
            forces.evaluate(&u, &mut scratch, &mut own, &serial);
            let rows = (kept.as_mut_slice(), None);
            forces.relax(&u, &mut history, &step, &mut scratch, rows, &serial);
        }
        let top = mesh.positions.iter().enumerate();
        let top = top.filter(|(_, p)| p[1] > 0.5 * SIDE);
        let sum = top.map(|(node, _)| f64::from(own[3 * node]) - f64::from(kept[3 * node]));
        out.push(sum.sum::<f64>() / f64::from(SIDE * SIDE));
    }
    Ok(out)
}

/// Largest error of the stress while it rises and while it is held, over the stress of the source at that time.
fn off(law: Law, step_s: f64, over: f64) -> Result<[f64; 2]> {
    let branch = Branch {
        share: SHARE,
        tau_s: over * step_s,
    };
    let material = Material {
        relaxation: Relaxation::new([branch]).context("one branch")?,
        ..Material::default().with_law(law)
    };
    let whole = |t: f64| (t / step_s).round() * step_s;
    let held = HELD.map(|part| RAMP_S + (part * branch.tau_s).min(LONGEST * RAMP_S));
    let times: Vec<f64> = RISING
        .map(|part| part * RAMP_S)
        .into_iter()
        .chain(held)
        .map(whole)
        .collect();
    let want = integrated(&material, branch, &times);
    let got = stepped(&material, step_s, &times)?;
    let errors: Vec<f64> = want
        .iter()
        .zip(&got)
        .map(|(want, got)| (got / want - 1.0).abs())
        .collect();
    let most = |list: &[f64]| list.iter().copied().fold(0.0, f64::max);
    let (rising, held) = errors.split_at(RISING.len());
    Ok([most(rising), most(held)])
}

fn laws() -> Result<[(&'static str, Law); 2]> {
    let terms = Ogden::new(&[[-163.0, -18.0]]).context("one term")?;
    Ok([
        ("neo-Hookean", Law::default()),
        ("Ogden, exponent -18", Law::Ogden(terms)),
    ])
}

pub fn section() -> Result<Section> {
    let mut text = String::from(
        "| law | step, ms | time constant over the step | largest error while the shear rises | while it is held | bar 3 % |\n|---|---:|---:|---:|---:|---|\n",
    );
    for (name, law) in laws()? {
        for step_s in STEPS_S {
            for over in OVER {
                let [rising, held] = off(law, step_s, over)?;
                text += &format!(
                    "| {name} | {} | {over} | {:.4} % | {:.4} % | {} |\n",
                    1e3 * step_s,
                    100.0 * rising,
                    100.0 * held,
                    verdict(rising.max(held) <= BAR)
                );
            }
        }
    }
    Ok(Section {
        name: "relaxation by steps",
        text,
        plots: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::{OVER, STEPS_S, integrated, laws, off, second_piola};
    use elements::{Branch, Law, Material};

    /// Of neo-Hookean tissue `S_xy = mu (1 + g²/3) g` and `S_yy = -mu g²/3`: with a branch that has no time to lose anything the integral is the law's own
    /// stress, and with one that loses all at once what lasts of it.
    #[test]
    fn the_other_integration_has_the_limits_of_the_law() {
        let material = Material::default();
        let (mu, g) = (material.shear_pa(), super::SHEAR);
        let [xy, yy] = second_piola(&material, g);
        assert!((xy / (mu * (1.0 + g * g / 3.0) * g) - 1.0).abs() < 1e-9);
        assert!((yy / (-mu * g * g / 3.0) - 1.0).abs() < 1e-9);
        for (tau_s, part) in [(1e6, 1.0), (1e-4, 1.0 - super::SHARE)] {
            let share = super::SHARE;
            let end = [super::RAMP_S + 0.01];
            let got = integrated(&material, Branch { share, tau_s }, &end)[0];
            assert!((got / (part * mu * g) - 1.0).abs() < 1e-5, "{tau_s}: {got}");
        }
    }

    /// At every time constant, and by the square of the step where that is longer.
    #[test]
    fn the_elements_recursion_is_that_of_the_equations() {
        for (name, law) in laws().unwrap() {
            for over in OVER {
                let [rising, held] = off(law, STEPS_S[0], over).unwrap();
                let bar = match law {
                    Law::NeoHookean(_) => 1e-3,
                    _ => 5e-3,
                };
                assert!(
                    rising < bar && held < bar,
                    "{name}, {over}: {rising} {held}"
                );
            }
            let [coarse, _] = off(law, STEPS_S[0], 1.0).unwrap();
            let [fine, _] = off(law, STEPS_S[1], 10.0).unwrap();
            assert!(fine < 0.1 * coarse + 2e-5, "{name}: {fine} for {coarse}");
        }
    }
}
