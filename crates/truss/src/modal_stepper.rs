//! Steps many oscillators together, from inputs to outputs.
//!
//! A step costs O(modes · inputs), a reading O(modes · outputs), neither O(dof²), and their results are bit-identical on
//! all machines.

use nalgebra::DMatrix;

use crate::assembly::Mechanics;
use crate::block_matrix::{Block, BlockMatrix, LANES};
use crate::modal::Modes;
use crate::model_error::ModelError;
use crate::oscillator::OscillatorStep;
use crate::structure::Structure;
use crate::vectorised::vectorised;

/// Far longer than any step of a sampled system \[s\].
const LONGEST_STEP_S: f64 = 1.0;

/// Exact zero-order-hold stepping of a modal model.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct ModalStepper {
    transitions: Vec<TransitionBlock>,
    /// Modal force per input (modes × inputs).
    input_map: BlockMatrix,
    /// Output per modal displacement (outputs × modes).
    output_map: BlockMatrix,
    displacements: Vec<Block>,
    velocities: Vec<Block>,
}

/// [`OscillatorStep`]s of a block of modes, coefficient by coefficient.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct TransitionBlock {
    displacement_keep: Block,
    displacement_from_velocity: Block,
    displacement_from_force: Block,
    velocity_from_displacement: Block,
    velocity_keep: Block,
    velocity_from_force: Block,
    /// 1/ω², displacement per constant modal force \[s²\].
    flexibility: Block,
}

impl ModalStepper {
    /// The local model of a module with all its modes, in equilibrium: eq. 6 and 7 from the forces of its actuators
    /// \[N\] to the elongations of its gages \[m\], without the effects of wind, loads and neighbours. `local` is that
    /// module alone, from [`Structure::local`] or from a file; `dt_s` is the step \[s\].
    ///
    /// # Errors
    /// The structure does not yield a valid model, or the step is not above 0 or is absurdly long.
    pub fn of_module(local: &Structure, dt_s: f64) -> Result<ModalStepper, ModelError> {
        if !(dt_s > 0.0 && dt_s <= LONGEST_STEP_S) {
            return Err(ModelError::TimeStep { value: dt_s });
        }
        let mechanics = Mechanics::assemble(local)?;
        let modes = Modes::of(&mechanics, local.damping, None)?;
        Ok(ModalStepper::new(&modes, dt_s, &mechanics.actuator_map, &mechanics.gage_map))
    }

    /// A stepper at rest.
    ///
    /// `dt_s` is the step \[s\]; `input_map` (dofs × inputs) maps inputs to nodal forces \[N\], `output_map` (outputs ×
    /// dofs) maps displacements \[m\] to outputs. Both maps must have the degrees of freedom of the modes; missing
    /// entries count as zero.
    #[must_use]
    pub fn new(
        modes: &Modes,
        dt_s: f64,
        input_map: &DMatrix<f64>,
        output_map: &DMatrix<f64>,
    ) -> ModalStepper {
        debug_assert_eq!(input_map.nrows(), modes.shapes.nrows(), "rows of the input map");
        debug_assert_eq!(output_map.ncols(), modes.shapes.nrows(), "columns of the output map");
        let (count, inputs, outputs) = (modes.count(), input_map.ncols(), output_map.nrows());
        let mode_blocks = count.div_ceil(LANES);
        ModalStepper {
            transitions: (0..mode_blocks).map(|b| transition_block(modes, dt_s, b)).collect(),
            input_map: BlockMatrix::from_fn(count, inputs, |mode, input| {
                dot(modes, mode, |dof| input_map.get((dof, input)))
            }),
            output_map: BlockMatrix::from_fn(outputs, count, |output, mode| {
                dot(modes, mode, |dof| output_map.get((output, dof)))
            }),
            displacements: vec![[0.0; LANES]; mode_blocks],
            velocities: vec![[0.0; LANES]; mode_blocks],
        }
    }

    /// Number of modes.
    #[must_use]
    pub fn mode_count(&self) -> usize {
        self.input_map.rows()
    }

    /// Number of inputs.
    #[must_use]
    pub fn input_count(&self) -> usize {
        self.input_map.columns()
    }

    /// Number of outputs.
    #[must_use]
    pub fn output_count(&self) -> usize {
        self.output_map.rows()
    }

    /// Advances by one step during which the inputs are constant, and so are forces on the modes besides, lowest mode
    /// first; of these missing ones are zero. Allocates nothing.
    ///
    /// `inputs` must have [`ModalStepper::input_count`] values.
    pub fn step(&mut self, inputs: &[f64], modal_forces: &[f64]) {
        debug_assert_eq!(inputs.len(), self.input_count(), "number of inputs");
        vectorised(
            #[inline(always)]
            || self.advance(inputs, modal_forces),
        );
    }

    #[inline(always)]
    fn advance(&mut self, inputs: &[f64], modal_forces: &[f64]) {
        for (block, transition) in self.transitions.iter().enumerate() {
            let force = self.modal_force(block, inputs, modal_forces);
            // Copies, so that the compiler sees that nothing here overlaps.
            let (q, v) = (self.displacements[block], self.velocities[block]);
            let (mut displacement, mut velocity) = (q, v);
            for lane in 0..LANES {
                let forced = transition.displacement_from_force[lane] * force[lane];
                let moved = transition.displacement_from_velocity[lane].mul_add(v[lane], forced);
                displacement[lane] = transition.displacement_keep[lane].mul_add(q[lane], moved);
                let forced = transition.velocity_from_force[lane] * force[lane];
                let kept = transition.velocity_keep[lane].mul_add(v[lane], forced);
                velocity[lane] = transition.velocity_from_displacement[lane].mul_add(q[lane], kept);
            }
            self.displacements[block] = displacement;
            self.velocities[block] = velocity;
        }
    }

    /// Forces on a block of modes.
    #[inline(always)]
    fn modal_force(&self, block: usize, inputs: &[f64], modal_forces: &[f64]) -> Block {
        let mut force = self.input_map.block_product(block, inputs);
        let besides = modal_forces.get(block * LANES..).unwrap_or_default();
        if let Some(besides) = besides.first_chunk::<LANES>() {
            for lane in 0..LANES {
                force[lane] += besides[lane];
            }
        } else {
            for (force, besides) in force.iter_mut().zip(besides) {
                *force += besides;
            }
        }
        force
    }

    /// Sets the state to static equilibrium under constant inputs and forces on the modes.
    ///
    /// `inputs` must have [`ModalStepper::input_count`] values.
    pub fn settle(&mut self, inputs: &[f64], modal_forces: &[f64]) {
        debug_assert_eq!(inputs.len(), self.input_count(), "number of inputs");
        for (block, transition) in self.transitions.iter().enumerate() {
            let force = self.modal_force(block, inputs, modal_forces);
            self.displacements[block] =
                std::array::from_fn(|lane| transition.flexibility[lane] * force[lane]);
            self.velocities[block] = [0.0; LANES];
        }
    }

    /// Resets the state to zero displacement at rest.
    pub fn reset(&mut self) {
        self.displacements.fill([0.0; LANES]);
        self.velocities.fill([0.0; LANES]);
    }

    /// Reads the outputs. Allocates nothing.
    ///
    /// `out` must have [`ModalStepper::output_count`] places.
    pub fn outputs(&self, out: &mut [f64]) {
        debug_assert_eq!(out.len(), self.output_count(), "number of outputs");
        self.read(&self.displacements, out);
    }

    /// Reads the rates of change of the outputs \[1/s\]. Allocates nothing.
    ///
    /// `out` must have [`ModalStepper::output_count`] places.
    pub fn output_rates(&self, out: &mut [f64]) {
        debug_assert_eq!(out.len(), self.output_count(), "number of outputs");
        self.read(&self.velocities, out);
    }

    /// Modal displacements q, lowest mode first [√kg·m].
    pub fn modal_displacements(&self) -> impl Iterator<Item = f64> + '_ {
        self.displacements.iter().flatten().copied().take(self.mode_count())
    }

    /// Modal velocities q̇, lowest mode first [√kg·m/s].
    pub fn modal_velocities(&self) -> impl Iterator<Item = f64> + '_ {
        self.velocities.iter().flatten().copied().take(self.mode_count())
    }

    fn read(&self, state: &[Block], out: &mut [f64]) {
        out.fill(0.0);
        self.output_map.add_product(state.as_flattened(), out);
    }
}

/// Scalar product of a mode shape with a row or column of a map.
fn dot<'a>(modes: &Modes, mode: usize, entry: impl Fn(usize) -> Option<&'a f64>) -> f64 {
    let shape = modes.shapes.column(mode);
    shape.iter().enumerate().map(|(dof, value)| value * entry(dof).copied().unwrap_or(0.0)).sum()
}

fn transition_block(modes: &Modes, dt_s: f64, block: usize) -> TransitionBlock {
    let mode = |lane: usize| block * LANES + lane;
    let transition = |lane: usize| {
        let omega = modes.angular_frequencies.get(mode(lane))?;
        let ratio = modes.damping_ratios.get(mode(lane))?;
        Some(OscillatorStep::over(dt_s, *omega, *ratio))
    };
    let all: [Option<OscillatorStep>; LANES] = std::array::from_fn(transition);
    let take = |pick: fn(&OscillatorStep) -> f64| all.map(|t| t.as_ref().map_or(0.0, pick));
    TransitionBlock {
        displacement_keep: take(|t| t.displacement_keep),
        displacement_from_velocity: take(|t| t.displacement_from_velocity),
        displacement_from_force: take(|t| t.displacement_from_force),
        velocity_from_displacement: take(|t| t.velocity_from_displacement),
        velocity_keep: take(|t| t.velocity_keep),
        velocity_from_force: take(|t| t.velocity_from_force),
        flexibility: std::array::from_fn(|lane| {
            modes.angular_frequencies.get(mode(lane)).map_or(0.0, |omega| 1.0 / (omega * omega))
        }),
    }
}
