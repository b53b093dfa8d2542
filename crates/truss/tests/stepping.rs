//! Authority: the exact solution, the matrix exponential, and stepping against itself.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a failing test may panic")]

mod shared;

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use truss::{Mechanics, ModalStepper, ModelError, Modes, Rayleigh};

const DT_S: f64 = 1e-3;

/// One oscillator: one mode, one input, one output.
fn oscillator(omega: f64, ratio: f64) -> Modes {
    Modes {
        angular_frequencies: DVector::from_element(1, omega),
        damping_ratios: DVector::from_element(1, ratio),
        shapes: DMatrix::from_element(1, 1, 1.0),
    }
}

fn stepper(modes: &Modes, dt_s: f64) -> ModalStepper {
    let one = DMatrix::from_element(1, 1, 1.0);
    ModalStepper::new(modes, dt_s, &one, &one)
}

/// Displacement and velocity after a time under a constant unit force from rest and from a given
/// state, by the scaled and squared series of the matrix exponential.
fn by_exponential(omega: f64, ratio: f64, time: f64, state: Vector2<f64>) -> Vector2<f64> {
    let system = Matrix2::new(0.0, 1.0, -omega * omega, -2.0 * ratio * omega);
    let augmented = nalgebra::Matrix3::new(
        system[(0, 0)],
        system[(0, 1)],
        0.0,
        system[(1, 0)],
        system[(1, 1)],
        1.0,
        0.0,
        0.0,
        0.0,
    ) * time;
    let squarings = (augmented.norm().max(1.0).log2().ceil() as i32 + 10).max(0);
    let small = augmented / 2.0_f64.powi(squarings);
    let mut term = nalgebra::Matrix3::identity();
    let mut sum = term;
    for order in 1..20 {
        term = term * small / f64::from(order);
        sum += term;
    }
    for _ in 0..squarings {
        sum = sum * sum;
    }
    let end = sum * nalgebra::Vector3::new(state[0], state[1], 1.0);
    Vector2::new(end[0], end[1])
}

#[test]
fn every_damping_regime_follows_the_matrix_exponential() {
    for omega in [0.3, 10.0, 300.0, 2000.0] {
        for ratio in [0.0, 0.02, 0.5, 0.999_999, 1.0, 1.000_001, 1.5, 6.0] {
            let mut stepper = stepper(&oscillator(omega, ratio), DT_S);
            let mut state = Vector2::zeros();
            for step in 0..5 {
                let (q, v) = read(&stepper);
                let expected = by_exponential(omega, ratio, DT_S, state);
                stepper.step(&[1.0], &[]);
                let (q1, v1) = read(&stepper);
                let scale_q = expected[0].abs().max(q.abs());
                let scale_v = expected[1].abs().max(v.abs()).max(omega * scale_q);
                assert!(
                    (q1 - expected[0]).abs() < 1e-9 * scale_q,
                    "{omega} {ratio} {step}: {q1} {}",
                    expected[0]
                );
                assert!(
                    (v1 - expected[1]).abs() < 1e-9 * scale_v,
                    "{omega} {ratio} {step}: {v1} {}",
                    expected[1]
                );
                state = Vector2::new(q1, v1);
            }
        }
    }
}

fn read(stepper: &ModalStepper) -> (f64, f64) {
    (stepper.modal_displacements().next().unwrap(), stepper.modal_velocities().next().unwrap())
}

/// Step response of an oscillator at rest, from textbooks.
fn closed_form(omega: f64, ratio: f64, time: f64) -> f64 {
    let decay = (-ratio * omega * time).exp();
    let shape = if ratio < 1.0 {
        let damped = omega * (1.0 - ratio * ratio).sqrt();
        (damped * time).cos() + ratio * omega / damped * (damped * time).sin()
    } else if ratio == 1.0 {
        1.0 + omega * time
    } else {
        let spread = omega * (ratio * ratio - 1.0).sqrt();
        (spread * time).cosh() + ratio * omega / spread * (spread * time).sinh()
    };
    (1.0 - decay * shape) / (omega * omega)
}

#[test]
fn many_steps_under_a_constant_input_follow_the_closed_form() {
    for ratio in [0.03, 1.0, 2.0] {
        let omega = 11.0;
        let mut stepper = stepper(&oscillator(omega, ratio), DT_S);
        for step in 1..=2000 {
            stepper.step(&[1.0], &[]);
            let expected = closed_form(omega, ratio, f64::from(step) * DT_S);
            let error = (read(&stepper).0 - expected).abs() * omega * omega;
            assert!(error < 1e-11, "ratio {ratio}, step {step}: {error}");
        }
    }
}

#[test]
fn two_half_steps_are_one_step() {
    for structure in shared::all() {
        let mechanics = Mechanics::assemble(&structure).unwrap();
        let modes = Modes::of(&mechanics, structure.damping, None).unwrap();
        let new =
            |dt_s| ModalStepper::new(&modes, dt_s, &mechanics.actuator_map, &mechanics.gage_map);
        let (mut whole, mut half) = (new(DT_S), new(DT_S / 2.0));
        let (mut a, mut b) = (vec![0.0; whole.output_count()], vec![0.0; whole.output_count()]);
        for step in 0..200 {
            let inputs: Vec<f64> =
                (0..whole.input_count()).map(|i| 1e4 * ((step * (i + 1)) as f64).sin()).collect();
            whole.step(&inputs, &[]);
            half.step(&inputs, &[]);
            half.step(&inputs, &[]);
            whole.outputs(&mut a);
            half.outputs(&mut b);
            let scale = a.iter().fold(1e-6_f64, |m, x| m.max(x.abs()));
            for (x, y) in a.iter().zip(&b) {
                assert!((x - y).abs() < 1e-10 * scale);
            }
        }
    }
}

#[test]
fn settling_is_where_a_constant_input_leads_in_the_long_run() {
    for structure in shared::all() {
        let mechanics = Mechanics::assemble(&structure).unwrap();
        let modes = Modes::of(&mechanics, structure.damping, None).unwrap();
        let new =
            |dt_s| ModalStepper::new(&modes, dt_s, &mechanics.actuator_map, &mechanics.gage_map);
        let inputs = vec![1e4; new(DT_S).input_count()];
        let (mut settled, mut long) = (new(DT_S), new(0.1));
        settled.settle(&inputs, &[]);
        for _ in 0..2000 {
            long.step(&inputs, &[]);
        }
        let read = |stepper: &ModalStepper| {
            let mut out = vec![0.0; stepper.output_count()];
            stepper.outputs(&mut out);
            out
        };
        let statics = mechanics.static_gage_responses().unwrap();
        let at_once = read(&settled);
        let scale = at_once.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (gage, (x, y)) in at_once.iter().zip(read(&long)).enumerate() {
            assert!((x - y).abs() < 1e-9 * scale);
            let direct: f64 = statics.row(gage).iter().map(|response| response * 1e4).sum();
            assert!((x - direct).abs() < 1e-8 * scale);
        }
        settled.step(&inputs, &[]);
        for (x, y) in at_once.iter().zip(read(&settled)) {
            assert!((x - y).abs() < 1e-10 * scale, "equilibrium stays");
        }
    }
}

#[test]
fn a_whole_structure_follows_its_own_equations_of_motion() {
    // Runge-Kutta on M·ξ̈ + D·ξ̇ + K·ξ = F, without modes.
    let structure = shared::small();
    let mechanics = Mechanics::assemble(&structure).unwrap();
    let modes = Modes::of(&mechanics, structure.damping, None).unwrap();
    let size = mechanics.dofs.len();
    let mut force = DMatrix::zeros(size, 1);
    force[(3, 0)] = 1.0;
    force[(11, 0)] = -0.5;
    let all = DMatrix::identity(size, size);
    let mut stepper = ModalStepper::new(&modes, DT_S, &force, &all);
    let (mut x, mut v) = (DVector::zeros(size), DVector::zeros(size));
    let Rayleigh { alpha_per_s, beta_s } = structure.damping;
    let acceleration = |x: &DVector<f64>, v: &DVector<f64>, input: f64| {
        let elastic = &mechanics.stiffness * (x + v * beta_s);
        let external = force.column(0) * input;
        (external - elastic).component_div(&mechanics.mass) - v * alpha_per_s
    };
    let mut out = vec![0.0; size];
    for step in 0..100 {
        let input = 1e4 * (f64::from(step) * 0.2).cos();
        stepper.step(&[input], &[]);
        let parts = 100;
        let h = DT_S / f64::from(parts);
        for _ in 0..parts {
            let (k1x, k1v) = (v.clone(), acceleration(&x, &v, input));
            let (x2, v2) = (&x + &k1x * (h / 2.0), &v + &k1v * (h / 2.0));
            let (k2x, k2v) = (v2.clone(), acceleration(&x2, &v2, input));
            let (x3, v3) = (&x + &k2x * (h / 2.0), &v + &k2v * (h / 2.0));
            let (k3x, k3v) = (v3.clone(), acceleration(&x3, &v3, input));
            let (x4, v4) = (&x + &k3x * h, &v + &k3v * h);
            let (k4x, k4v) = (v4.clone(), acceleration(&x4, &v4, input));
            x += (k1x + k2x * 2.0 + k3x * 2.0 + k4x) * (h / 6.0);
            v += (k1v + k2v * 2.0 + k3v * 2.0 + k4v) * (h / 6.0);
        }
        stepper.outputs(&mut out);
        let scale = x.amax();
        for (own, expected) in out.iter().zip(x.iter()) {
            assert!((own - expected).abs() < 1e-6 * scale, "step {step}: {own} {expected}");
        }
    }
}

#[test]
fn very_stiff_and_very_damped_modes_stay_finite() {
    for (omega, ratio) in [(1e6, 5e3), (1e5, 0.01), (1e-3, 50.0), (1e4, 1.0)] {
        let mut stepper = stepper(&oscillator(omega, ratio), DT_S);
        for _ in 0..100 {
            stepper.step(&[1.0], &[]);
        }
        let (q, v) = read(&stepper);
        assert!(q.is_finite() && v.is_finite());
        assert!(q * omega * omega <= 2.0);
    }
}

#[test]
fn reset_brings_back_rest() {
    let structure = shared::small();
    let mut model = ModalStepper::of_module(&shared::local(&structure, "lower"), DT_S).unwrap();
    let mut stepper = stepper(&oscillator(10.0, 0.1), DT_S);
    stepper.step(&[1.0], &[]);
    stepper.reset();
    assert_eq!(read(&stepper), (0.0, 0.0));
    let mut out = vec![1.0; model.output_count()];
    model.outputs(&mut out);
    assert!(out.iter().all(|&x| x == 0.0));
    model.step(&vec![1e3; model.input_count()], &[]);
    model.outputs(&mut out);
    assert!(out.iter().any(|&x| x != 0.0));
}

#[test]
fn a_local_model_settles_on_the_static_responses() {
    let structure = shared::tower();
    for module in structure.equipped() {
        let local = structure.local(&module.name).unwrap();
        let statics = Mechanics::assemble(&local).unwrap().static_gage_responses().unwrap();
        let mut model = ModalStepper::of_module(&local, DT_S).unwrap();
        assert_eq!((model.input_count(), model.output_count()), (4, 8));
        let forces = [1e4, -2e4, 5e3, 0.0];
        model.settle(&forces, &[]);
        let mut out = [0.0; 8];
        model.outputs(&mut out);
        for (gage, own) in out.iter().enumerate() {
            let expected: f64 =
                forces.iter().enumerate().map(|(a, f)| statics[(gage, a)] * f).sum();
            assert!((own - expected).abs() < 1e-12, "{own} {expected}");
        }
    }
}

#[test]
fn a_time_step_that_is_none_is_refused() {
    let local = shared::local(&shared::small(), "lower");
    for value in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
        let error = ModalStepper::of_module(&local, value).unwrap_err();
        assert!(matches!(error, ModelError::TimeStep { .. }));
        assert!(error.to_string().contains("above 0"));
    }
}
