//! Prints the push factor and angles of every scheme as CSV: `scheme,t_s,push,phi_deg,theta_deg`.
//! `training/scripts/plot_schemes.py` draws them.

use tissue::schemes::{Draw, Group, Scheme};

fn main() {
    let draw = Draw {
        depth: 0.5,
        size: 0.5,
        angle: 0.1,
    };
    println!("scheme,t_s,push,phi_deg,theta_deg");
    for scheme in Scheme::NUMBERED.into_iter().chain(Scheme::of(Group::Hard)) {
        for step in 0..=800 {
            let t = f64::from(step) * 0.01;
            let pose = scheme.pose(t, draw);
            println!(
                "{},{t},{},{},{}",
                scheme.name(),
                pose.push,
                pose.phi.to_degrees(),
                pose.theta.to_degrees()
            );
        }
    }
}
