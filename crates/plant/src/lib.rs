//! The true tower: wind, loads, hydraulics, gages, controller and faults (section 3 of the paper).
//!
//! [`Plant`] steps the whole structure and outputs the measurements of its modules. It represents reality: diagnosers
//! have no access to it, and [`Mismatch`] makes it differ from their nominal model.
//!
//! Sequence of one step: [`wind`] → [`loads`](LoadParameters) and forces on nodes ([`MovingLoad`], [`RecordedLoad`]) → structure (`truss`) → [`gage`] and pressure sensors →
//! Kalman filter and regulator ([`controller`]) → demands → [`hydraulics`] → forces. Faults act in the gages and in the
//! hydraulics ([`injection`]).
//!
//! Pure: no clock, no input or output, and all randomness from one seed. The same seed gives bit-identical results on
//! the same kind of processor; only the design of the controller and the modes, computed once, uses matrix products
//! that select their instructions at run time.

mod check;
mod contact;
pub mod controller;
mod course;
mod error;
pub mod gage;
mod gains;
pub mod hydraulics;
pub mod injection;
mod live_loads;
mod loads;
mod mismatch;
mod moving_loads;
mod nodal_loads;
mod nominal;
mod parameters;
mod part;
mod plant;
mod pressure_sensor;
pub mod riccati;
mod signals;
mod slow_elongations;
mod streams;
mod stroke;
mod temperature;
mod tolerance;
mod tower;
pub mod wind;
mod wind_loads;

pub use check::{ParameterError, ParameterErrors};
pub use error::PlantError;
pub use gage::GageParameters;
pub use hydraulics::HydraulicParameters;
pub use injection::InjectError;
pub use loads::LoadParameters;
pub use mismatch::Mismatch;
pub use moving_loads::MovingLoad;
pub use nodal_loads::RecordedLoad;
pub use parameters::{ControllerParameters, PlantParameters};
pub use plant::{DrawnConditions, Plant};
pub use signals::{ModuleSignals, Signals};
pub use stroke::{StrokeError, StrokeTest};
pub use temperature::TemperatureParameters;
pub use tolerance::{ModuleMessage, Tolerance, ToleranceSettings};
pub use wind::{BaseSpeed, WindParameters};
