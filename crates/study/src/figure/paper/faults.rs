//! How large the figures' faults are. The paper does not say: they lie in the middle of what the
//! campaign's scenarios are drawn from.

use vocabulary::fault::Fault;

use crate::scenarios::ScenarioCampaign;

fn middle([from, to]: [f64; 2]) -> f64 {
    0.5 * (from + to)
}

/// A bias of a gage of this length.
pub(super) fn bias(campaign: &ScenarioCampaign, length_m: f64) -> Fault {
    Fault::Bias { offset_m: length_m * middle(campaign.ranges.bias_strain) }
}

/// A random walk of a gage of this length. The middle of its drift is none, so it has the largest.
pub(super) fn random_walk(campaign: &ScenarioCampaign, length_m: f64) -> Fault {
    let ranges = &campaign.ranges;
    let per_ms = (campaign.system.parameters.step_s / 1e-3).sqrt();
    Fault::RandomWalk {
        drift_m_per_s: length_m * ranges.drift_strain_per_s[1],
        increment_m: length_m * middle(ranges.increment_strain) * per_ms,
    }
}

/// A leak of chamber A to the environment.
pub(super) fn external_leakage_a(campaign: &ScenarioCampaign) -> Fault {
    Fault::ExternalLeakageA { area_m2: middle(campaign.ranges.leak_area_m2) }
}
