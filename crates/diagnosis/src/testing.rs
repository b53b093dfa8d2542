//! Figures that several tests need.

use crate::residual::NominalHydraulics;

/// The cylinder of the shipped tower.
pub(crate) fn hydraulics() -> NominalHydraulics {
    NominalHydraulics {
        area_a_m2: 1.3273e-2,
        area_b_m2: 9.425e-3,
        volume_a_m3: 2.323e-3,
        volume_b_m3: 1.649e-3,
        bulk_modulus_pa: 1.3e9,
        force_gain_m3_per_s_n: 6.7e-9,
        valve_flow_m3_per_s: 3.5e-4,
        supply_pa: 200e5,
        tank_pa: 1e5,
        pressure_noise_pa: 1e4,
        speed_uncertainty: 0.25,
    }
}
