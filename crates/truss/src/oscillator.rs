//! The exact step of one oscillator.
//!
//! q̈ + 2·ζ·ω·q̇ + ω²·q = p with p held constant over a step Δt (zero-order hold). With the decay
//! x = ζ·ω·Δt, θ² = (ω·Δt)² − x² and S = e⁻ˣ·sin θ / θ, C = e⁻ˣ·cos θ:
//!
//! - q ← (C + x·S)·q + Δt·S·v + (1 − C − x·S)/ω²·p
//! - v ← −ω²·Δt·S·q + (C − x·S)·v + Δt·S·p
//!
//! θ² < 0 is the overdamped case. With the two decays r₁ < r₂, r₁·r₂ = (ω·Δt)², r₁ + r₂ = 2·x:
//! S = (e^(−r₁) − e^(−r₂))/(r₂ − r₁), C = (e^(−r₁) + e^(−r₂))/2, which neither overflows for stiff modes nor loses
//! digits to cancellation. Towards θ = 0 both tend to S = e⁻ˣ, the critically damped case.

/// Below this |θ²| the sine quotient is computed from its series, which is exact there to the last bit.
const SERIES_BELOW: f64 = 1e-4;

/// The coefficients of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OscillatorStep {
    /// Displacement from displacement.
    pub(crate) displacement_keep: f64,
    /// Displacement from velocity \[s\].
    pub(crate) displacement_from_velocity: f64,
    /// Displacement from modal force \[s²\].
    pub(crate) displacement_from_force: f64,
    /// Velocity from displacement \[1/s\].
    pub(crate) velocity_from_displacement: f64,
    /// Velocity from velocity.
    pub(crate) velocity_keep: f64,
    /// Velocity from modal force \[s\].
    pub(crate) velocity_from_force: f64,
}

impl OscillatorStep {
    /// The step of an oscillator with angular frequency ω > 0 \[rad/s\] and damping ratio ζ ≥ 0.
    pub(crate) fn over(dt_s: f64, angular_frequency: f64, damping_ratio: f64) -> OscillatorStep {
        let turn = angular_frequency * dt_s;
        let decay = damping_ratio * turn;
        let squared_angle = turn * turn * (1.0 - damping_ratio) * (1.0 + damping_ratio);
        let Response { cosine, sine_quotient, step } = if squared_angle < -SERIES_BELOW {
            overdamped(turn, decay, (-squared_angle).sqrt())
        } else {
            oscillating(decay, squared_angle)
        };
        let stiffness = angular_frequency * angular_frequency;
        OscillatorStep {
            displacement_keep: cosine + decay * sine_quotient,
            displacement_from_velocity: dt_s * sine_quotient,
            displacement_from_force: step / stiffness,
            velocity_from_displacement: -stiffness * dt_s * sine_quotient,
            velocity_keep: cosine - decay * sine_quotient,
            velocity_from_force: dt_s * sine_quotient,
        }
    }
}

struct Response {
    /// C as defined in the module documentation.
    cosine: f64,
    /// S as defined in the module documentation.
    sine_quotient: f64,
    /// 1 − C − x·S, the step response in units of its static value.
    step: f64,
}

/// Underdamped, critical and barely overdamped.
fn oscillating(decay: f64, squared_angle: f64) -> Response {
    let envelope = libm::exp(-decay);
    let (versine, quotient) = if squared_angle.abs() <= SERIES_BELOW {
        series(squared_angle)
    } else {
        let angle = squared_angle.sqrt();
        let half = libm::sin(0.5 * angle);
        (2.0 * half * half, libm::sin(angle) / angle)
    };
    Response {
        cosine: envelope * (1.0 - versine),
        sine_quotient: envelope * quotient,
        // 1 − e⁻ˣ·(cos θ + x·sin θ/θ), with the ones cancelled analytically.
        step: -libm::expm1(-decay) + envelope * (versine - decay * quotient),
    }
}

/// 1 − cos θ and sin θ / θ from θ², of either sign.
fn series(s: f64) -> (f64, f64) {
    let versine = s / 2.0 * (1.0 - s / 12.0 * (1.0 - s / 30.0 * (1.0 - s / 56.0)));
    let quotient = 1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0));
    (versine, quotient)
}

fn overdamped(turn: f64, decay: f64, spread: f64) -> Response {
    let fast = decay + spread;
    let slow = turn * turn / fast;
    let (slow_rest, fast_rest) = (libm::exp(-slow), libm::exp(-fast));
    Response {
        cosine: 0.5 * (slow_rest + fast_rest),
        sine_quotient: (slow_rest - fast_rest) / (2.0 * spread),
        step: (slow * libm::expm1(-fast) - fast * libm::expm1(-slow)) / (2.0 * spread),
    }
}
