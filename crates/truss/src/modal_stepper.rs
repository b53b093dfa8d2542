//! Steps many oscillators together, from inputs to outputs.
//!
//! A step costs O(modes · inputs), a reading O(modes · outputs), neither O(dof²). Maps are stored in blocks of
//! [`LANES`] modes (or outputs) in the order of the loops, so that the inner loop runs over independent lanes: it
//! vectorises without reordering any sum, and the results are bit-identical on all machines.

use nalgebra::DMatrix;
use pulp::Arch;

use crate::assembly::Mechanics;
use crate::modal::Modes;
use crate::model_error::ModelError;
use crate::oscillator::OscillatorStep;
use crate::structure::Structure;

/// Width of a block.
const LANES: usize = 8;
/// Far longer than any step of a sampled system \[s\].
const LONGEST_STEP_S: f64 = 1.0;

type Block = [f64; LANES];

/// Exact zero-order-hold stepping of a modal model.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct ModalStepper {
    modes: usize,
    inputs: usize,
    outputs: usize,
    transitions: Vec<TransitionBlock>,
    /// Modal force per input: for each block of modes, one block per input.
    input_map: Vec<Block>,
    /// Output per modal displacement: for each block of outputs, one block per mode.
    output_map: Vec<Block>,
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
            modes: count,
            inputs,
            outputs,
            transitions: (0..mode_blocks).map(|b| transition_block(modes, dt_s, b)).collect(),
            input_map: blocks(mode_blocks, inputs, |mode, input| {
                dot(modes, mode, |dof| input_map.get((dof, input)))
            }),
            output_map: blocks(outputs.div_ceil(LANES), count, |output, mode| {
                dot(modes, mode, |dof| output_map.get((output, dof)))
            }),
            displacements: vec![[0.0; LANES]; mode_blocks],
            velocities: vec![[0.0; LANES]; mode_blocks],
        }
    }

    /// Number of modes.
    #[must_use]
    pub fn mode_count(&self) -> usize {
        self.modes
    }

    /// Number of inputs.
    #[must_use]
    pub fn input_count(&self) -> usize {
        self.inputs
    }

    /// Number of outputs.
    #[must_use]
    pub fn output_count(&self) -> usize {
        self.outputs
    }

    /// Advances by one step during which the inputs are constant. Allocates nothing.
    ///
    /// `inputs` must have [`ModalStepper::input_count`] values.
    pub fn step(&mut self, inputs: &[f64]) {
        debug_assert_eq!(inputs.len(), self.inputs, "number of inputs");
        Arch::new().dispatch(|| self.advance(inputs));
    }

    /// Compiled for several instruction sets of the processor; operations and their order, and hence the results to the
    /// last bit, are the same for all.
    #[inline(always)]
    fn advance(&mut self, inputs: &[f64]) {
        for (block, transition) in self.transitions.iter().enumerate() {
            let force = modal_force(&self.input_map, self.inputs, block, inputs);
            let (displacement, velocity) =
                (&mut self.displacements[block], &mut self.velocities[block]);
            for (lane, &p) in force.iter().enumerate() {
                let (q, v) = (displacement[lane], velocity[lane]);
                displacement[lane] = transition.displacement_keep[lane] * q
                    + transition.displacement_from_velocity[lane] * v
                    + transition.displacement_from_force[lane] * p;
                velocity[lane] = transition.velocity_from_displacement[lane] * q
                    + transition.velocity_keep[lane] * v
                    + transition.velocity_from_force[lane] * p;
            }
        }
    }

    /// Sets the state to static equilibrium under constant inputs.
    ///
    /// `inputs` must have [`ModalStepper::input_count`] values.
    pub fn settle(&mut self, inputs: &[f64]) {
        debug_assert_eq!(inputs.len(), self.inputs, "number of inputs");
        for (block, transition) in self.transitions.iter().enumerate() {
            let force = modal_force(&self.input_map, self.inputs, block, inputs);
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
        debug_assert_eq!(out.len(), self.outputs, "number of outputs");
        self.read(&self.displacements, out);
    }

    /// Reads the rates of change of the outputs \[1/s\]. Allocates nothing.
    ///
    /// `out` must have [`ModalStepper::output_count`] places.
    pub fn output_rates(&self, out: &mut [f64]) {
        debug_assert_eq!(out.len(), self.outputs, "number of outputs");
        self.read(&self.velocities, out);
    }

    /// Modal displacements q, lowest mode first [√kg·m].
    pub fn modal_displacements(&self) -> impl Iterator<Item = f64> + '_ {
        self.displacements.iter().flatten().copied().take(self.modes)
    }

    /// Modal velocities q̇, lowest mode first [√kg·m/s].
    pub fn modal_velocities(&self) -> impl Iterator<Item = f64> + '_ {
        self.velocities.iter().flatten().copied().take(self.modes)
    }

    fn read(&self, state: &[Block], out: &mut [f64]) {
        Arch::new().dispatch(|| self.combine(state, out));
    }

    /// Compiled like [`ModalStepper::advance`].
    #[inline(always)]
    fn combine(&self, state: &[Block], out: &mut [f64]) {
        if self.modes == 0 {
            out.fill(0.0);
            return;
        }
        for (rows, target) in self.output_map.chunks_exact(self.modes).zip(out.chunks_mut(LANES)) {
            let mut sums = [0.0; LANES];
            for (row, &q) in rows.iter().zip(state.iter().flatten()) {
                for lane in 0..LANES {
                    sums[lane] += row[lane] * q;
                }
            }
            for (value, sum) in target.iter_mut().zip(sums) {
                *value = sum;
            }
        }
    }
}

/// Forces on a block of modes.
#[inline(always)]
fn modal_force(input_map: &[Block], count: usize, block: usize, inputs: &[f64]) -> Block {
    let mut force = [0.0; LANES];
    // `input_map` contains `count` blocks for each block of modes.
    let shares = &input_map[block * count..(block + 1) * count];
    for (share, &input) in shares.iter().zip(inputs) {
        for lane in 0..LANES {
            force[lane] += share[lane] * input;
        }
    }
    force
}

/// Fills `rows` blocks of `columns` each; lanes beyond the data stay zero through `value`.
fn blocks(rows: usize, columns: usize, value: impl Fn(usize, usize) -> f64) -> Vec<Block> {
    let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    places
        .map(|(row, column)| std::array::from_fn(|lane| value(row * LANES + lane, column)))
        .collect()
}

/// Scalar product of a mode shape with a row or column of a map; zero for modes that do not exist.
fn dot<'a>(modes: &Modes, mode: usize, entry: impl Fn(usize) -> Option<&'a f64>) -> f64 {
    if mode >= modes.count() {
        return 0.0;
    }
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
