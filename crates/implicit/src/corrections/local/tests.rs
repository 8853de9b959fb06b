//! What the local products say of a state against the residual of the whole body there.

use std::cell::RefCell;
use std::path::Path;

use super::centres::{Reached, is_by, reach_of};
use super::columns::Response;
use super::*;
use crate::bundle::{BundleFiles, Mesh};
use crate::contact::Tangent;
use crate::corrections::input::{Enough, Report};
use crate::corrections::{Corrections, ImplicitSolver};
use crate::field::ContactSet;
use crate::kernels::random::Random;
use crate::kernels::{Isa, Pool};
use crate::prior::PriorTable;

/// A solver at rest, in contact with nothing, of a shipped bundle.
struct Bench {
    mesh: Mesh,
    prior: PriorTable,
    corrections: Corrections,
    pool: Pool,
    contact: ContactSet,
    zero: Vec<f32>,
}

impl Bench {
    fn open() -> Bench {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .join("onnx/brain-coarse-reduced");
        let files = BundleFiles::open(&folder).unwrap();
        let manifest = &files.manifest;
        let file = files.tensors(&manifest.mesh.file).unwrap();
        let mesh = Mesh::parse(&file, manifest.boundary).unwrap();
        let entry = manifest.prior.as_ref().unwrap();
        let prior = PriorTable::open(&files, entry, &mesh).unwrap();
        Bench {
            corrections: Corrections::open(&files, &mesh, Some(&prior), Isa::detect()).unwrap(),
            pool: Pool::new(1).unwrap(),
            contact: ContactSet::default(),
            zero: vec![0.0; 3 * mesh.node_count()],
            prior,
            mesh,
        }
    }

    fn context(&self) -> SolverContext<'_> {
        SolverContext {
            isa: Isa::detect(),
            pool: &self.pool,
            prior: &self.prior,
            corrections: &self.corrections,
            time_step: &self.corrections.time_step,
            held: &self.corrections.body.held,
        }
    }

    fn input(&self) -> Input<'_> {
        Input {
            rest: &self.mesh.positions,
            contact: &self.contact,
            last: &self.zero,
            before: &self.zero,
            still: false,
            load: None,
            way: [0.0, 1.0],
            enough: Enough {
                iterations: 3,
                error_mm: 0.0,
                until: None,
            },
        }
    }

    /// A field of modes `[K,3]`, about `size_mm` at its largest.
    fn smooth(&self, random: &mut Random, size_mm: f32) -> (Vec<f32>, Vec<f32>) {
        let env = self.context().env();
        let mut preconditioner = Preconditioner::new(env).unwrap();
        let mut c = random.normal(env.space.count(), 1.0);
        // The first modes are the largest.
        let weights = (0..c.len()).map(|at| 1.0 / (1.0 + at as f32));
        c.iter_mut()
            .zip(weights)
            .for_each(|(c, weight)| *c *= weight);
        let mut field = self.zero.clone();
        preconditioner.take_coordinates(env, &c).unwrap();
        preconditioner.decode(env, &mut field).unwrap();
        crate::corrections::precondition::mask_held(&env.held.is, &mut field);
        let largest = field.iter().fold(0.0f32, |most, u| most.max(u.abs()));
        let factor = size_mm / largest;
        c.iter_mut().for_each(|c| *c *= factor);
        field.iter_mut().for_each(|u| *u *= factor);
        (c, field)
    }
}

impl Bench {
    /// The local solver with `u` as its base and one node touched.
    fn begun<'a>(
        &'a self,
        input: &'a Input<'a>,
        solver: &'a mut ImplicitSolver,
        u: &[f32],
        touched: u32,
    ) -> (&'a mut LocalSolver, StepContext<'a>) {
        let context = self.context();
        let (mut residual, still) = (self.zero.clone(), &self.zero);
        let mut report = Report::default();
        solver
            .balance
            .residual(context, [still, u, u], &mut residual, &mut report)
            .unwrap();
        let local = LocalSolver::made(&mut solver.local, context).unwrap();
        local.reach.touched = vec![touched];
        let mut step = StepContext {
            context,
            input,
            preconditioner: &mut solver.preconditioner,
            scratch: &mut solver.balance.scratch,
            drift: &solver.balance.drift,
        };
        let base = Base {
            u,
            residual: &residual,
        };
        local.begin(&mut step, base).unwrap();
        (local, step)
    }
}

fn relative(found: &[f32], wanted: &[f32], change: f64) -> f64 {
    let mut difference = found.to_vec();
    add(-1.0, wanted, &mut difference);
    dot(&difference, &difference).sqrt() / change
}

/// Errors of `r_S` and `Phi^T r` over what they change, after a step of `t` and modes from a deformed base.
fn errors(bench: &Bench, base_mm: f32, step_mm: f32) -> [f64; 2] {
    let (context, input) = (bench.context(), bench.input());
    let env = context.env();
    let mut random = Random::new(11);
    let mut solver = ImplicitSolver::new(context).unwrap();
    let (_, u) = bench.smooth(&mut random, base_mm);
    let middle = bench.mesh.domain.nodes[bench.mesh.domain.nodes.len() / 2];
    let (local, mut step) = bench.begun(&input, &mut solver, &u, middle);
    assert!(
        local.set.near.places.inside > 20
            && local.set.near.places.nodes.len() < bench.mesh.node_count() / 2
    );

    let (c, _) = bench.smooth(&mut random, step_mm);
    local.d.step.clear(&local.set.near).unwrap();
    local.d.step.c.copy_from_slice(&c);
    local.d.step.t = random.normal(3 * local.set.near.places.inside, 0.05 * step_mm);
    local.decode_direction(&mut step).unwrap();
    let stiff = &mut local.d.stiff;
    step.preconditioner.stiffen(env, &c, stiff).unwrap();
    (local.set.near).linear(env, &local.d.modes, None, &mut local.d.linear);
    local.place_at(&u, 1.0);
    local.evaluate(&mut step, 1.0).unwrap();
    let found = local.residuals.next.p.clone();

    // The same state of the whole body.
    local.now.step.add(1.0, &local.d.step);
    let (mut whole, mut scratch) = (u.clone(), bench.zero.clone());
    local
        .settle(&mut step, &bench.zero, (&mut scratch, &mut whole), false)
        .unwrap();
    let at_base = local.residuals.base_modes.clone();
    let (near, r_found) = (
        local.set.near.places.nodes.clone(),
        local.residuals.next.r.clone(),
    );
    let before = local.residuals.base.clone();
    let inside = local.set.near.places.inside;
    let (mut r, still) = (bench.zero.clone(), &bench.zero);
    let mut report = Report::default();
    solver
        .balance
        .residual(context, [still, &whole, &whole], &mut r, &mut report)
        .unwrap();
    let r_whole: Vec<f32> = near[..inside]
        .iter()
        .flat_map(|&node| r[3 * node as usize..][..3].to_vec())
        .collect();
    solver.preconditioner.project(env, &r).unwrap();
    let q = solver.preconditioner.coordinates.clone();
    let mut wanted = found.clone();
    context.env().on_modes(&q, &mut wanted).unwrap();
    let change = relative(&wanted, &at_base, 1.0);
    let change_near = relative(&r_whole, &before[..3 * inside], 1.0);
    [
        relative(&r_found, &r_whole, change_near),
        relative(&found, &wanted, change),
    ]
}

#[test]
fn the_products_are_those_of_the_whole_body() {
    let bench = Bench::open();
    // Small steps from rest: all but the rounding.
    let [near, modes] = errors(&bench, 0.01, 0.01);
    assert!(near < 1e-3 && modes < 2e-3, "at rest: {near:e}, {modes:e}");
    // From a body that has turned: near exact, far the nonlinearity of the clusters.
    let [near, modes] = errors(&bench, 4.0, 0.5);
    assert!(near < 1e-3 && modes < 0.1, "turned: {near:e}, {modes:e}");
}

#[test]
fn contact_has_the_compliance_of_the_preconditioner() {
    let bench = Bench::open();
    let (context, input) = (bench.context(), bench.input());
    let env = context.env();
    let mut solver = ImplicitSolver::new(context).unwrap();
    let (_, u) = bench.smooth(&mut Random::new(5), 4.0);
    let nodes = &bench.prior.contact_nodes;
    let (local, mut step) = bench.begun(&input, &mut solver, &u, nodes[nodes.len() / 2]);
    // Two in the core, two outside of it.
    let all = 0..nodes.len() as u32;
    let place = |column: &u32| local.set.near.places.of(nodes[*column as usize]);
    let (core, inside) = (local.set.near.places.core, local.set.near.places.inside);
    let within = |from: usize, to: usize| {
        let is_there = move |column: &u32| place(column).is_some_and(|p| (from..to).contains(&p));
        all.clone().filter(is_there).take(2)
    };
    let mut columns: Vec<u32> = within(0, core).chain(within(core, inside)).collect();
    columns.sort_unstable();
    assert_eq!(columns.len(), 4);
    let order = 3 * columns.len();
    let mut upper = vec![0.0; order * order];
    let own = (
        &mut local.set.factor,
        &mut local.spare.columns,
        &mut local.spare.room,
    );
    let response = Response {
        env,
        near: &local.set.near,
        preconditioner: step.preconditioner,
        own: RefCell::new(own),
    };
    response.gather(&columns, &mut upper).unwrap();
    let largest = upper.iter().fold(0.0f64, |most, a| most.max(a.abs()));
    for from in 0..order {
        // The preconditioner's answer to 1 mN there, at all of them.
        local.spare.loads = vec![(3 * columns[from / 3] + (from % 3) as u32, 1.0)];
        local.d.step.clear(&local.set.near).unwrap();
        resize(&mut local.d.modes, 3 * local.set.near.places.nodes.len()).unwrap();
        local.respond(&mut step).unwrap();
        local.decode_direction(&mut step).unwrap();
        for to in 0..order {
            let node = nodes[columns[to / 3] as usize];
            let at = 3 * local.set.near.places.of(node).unwrap() + to % 3;
            let found = f64::from(local.d.step.t[at] + local.d.modes[at]);
            let wanted = upper[from.min(to) * order + from.max(to)];
            assert!(
                (found - wanted).abs() < 2e-3 * largest,
                "{found} for {wanted} of {largest}, {from} to {to}"
            );
        }
    }
}

/// What is said of a box holds for each of its nodes.
#[test]
fn what_is_reached_of_a_box_is_what_is_reached_of_its_nodes() {
    let mut random = Random::new(3);
    let (mut found, mut close) = ([0; 3], Vec::new());
    for _ in 0..2000 {
        let mut rest = random.normal(3 * 24, 8.0);
        // The first eight lie about a place of their own.
        let apart = random.normal(3, 20.0);
        for at in rest[..24].as_chunks_mut::<3>().0 {
            at.iter_mut()
                .zip(&apart)
                .for_each(|(x, apart)| *x = 0.5 * *x + apart);
        }
        let mut bounds = [[f32::MAX; 3], [f32::MIN; 3]];
        for at in rest[..24].as_chunks::<3>().0 {
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(at[axis]);
                bounds[1][axis] = bounds[1][axis].max(at[axis]);
            }
        }
        let centres: Vec<u32> = (8..24).collect();
        let reached = reach_of((&rest, &centres), 20.0, &bounds, &mut close).unwrap();
        found[reached as usize] += 1;
        for node in 0..8 {
            let said = match reached {
                Reached::Nothing => false,
                Reached::Part => is_by(&rest, &close, node, 20.0),
                Reached::Whole => true,
            };
            assert_eq!(said, is_by(&rest, &centres, node, 20.0));
        }
    }
    assert!(found.iter().all(|count| *count > 50), "{found:?}");
}

/// What is near, and the bits of a solve of its factor and of what it leaves of the clusters.
fn near_of(local: &mut LocalSolver) -> (Vec<u32>, Vec<u32>, Vec<u32>) {
    let Set { near, factor, .. } = &mut local.set;
    let mut t = vec![1.0; 3 * near.places.core];
    factor.solve(Isa::detect(), &mut t);
    let numbers = t.iter().chain(&local.clusters.on_modes);
    let bits = numbers.map(|x| x.to_bits()).collect();
    (near.centres.clone(), near.places.nodes.clone(), bits)
}

/// The next set takes a part a step and has the bits of one that is made at once, also where steps are made again or the solver is another one.
#[test]
fn the_next_set_comes_over_steps() {
    let bench = Bench::open();
    let (context, input) = (bench.context(), bench.input());
    let (_, u) = bench.smooth(&mut Random::new(5), 2.0);
    let base = Base {
        u: &u,
        residual: &bench.zero,
    };
    let rest = &bench.mesh.positions;
    let domain = &bench.mesh.domain.nodes;
    let first = domain[domain.len() / 2];
    let at = |node: u32, from: f32, to: f32| {
        !is_by(rest, &[first], node, from) && is_by(rest, &[first], node, to)
    };
    let within = |from, to| *domain.iter().find(|node| at(**node, from, to)).unwrap();
    // Farther than a set may lie from what is touched, but not so far that it has to go at once; and farther than that.
    let (second, third) = (within(5.5, 8.5), within(15.0, 30.0));
    let mut solvers = [0, 1].map(|_| ImplicitSolver::new(context).unwrap());
    let [solver, other] = &mut solvers;
    let (local, mut step) = bench.begun(&input, solver, &u, first);
    let at_first = near_of(local);
    local.coming.commit();
    local.reach.touched = vec![second];
    let mut kept = Vec::new();
    for parts in [1, 2, 0] {
        kept.push(local.coming.copy().unwrap());
        // Twice: the step is made again.
        for _ in 0..2 {
            local.coming.begin();
            local.begin(&mut step, base).unwrap();
            local.begin(&mut step, base).unwrap();
            let is_at_first = near_of(local) == at_first;
            assert_eq!(
                (local.coming.course.next.parts, is_at_first),
                (parts, parts > 0)
            );
        }
        local.coming.commit();
    }
    let wanted = near_of(local);
    assert_eq!(wanted.0, [second]);

    // From what is kept after each of these steps, and without any set of before.
    for (at, course) in kept.iter().enumerate() {
        let (local, mut step) = bench.begun(&input, other, &u, third);
        assert_eq!(near_of(local).0, [third]);
        local.coming.restore(course).unwrap();
        local.reach.touched = vec![second];
        for _ in at..3 {
            local.begin(&mut step, base).unwrap();
            local.coming.commit();
        }
        assert_eq!(near_of(local), wanted, "from step {at}");
        local.coming.restore(&Course::default()).unwrap();
    }
    let (local, _) = bench.begun(&input, other, &u, second);
    assert_eq!(near_of(local), wanted, "at once");
}
