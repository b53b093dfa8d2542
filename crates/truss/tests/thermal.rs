//! Authority: statics by hand. A statically determinate truss takes any free strain of its members without
//! stress; two rods between walls share it.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a failing test may panic")]

use truss::{Mechanics, Structure};

const REST: &str = r#"
[damping]
alpha_per_s = 0.1
beta_s = 0.001
[materials.steel]
young_pa = 210e9
poisson = 0.3
density_kg_per_m3 = 7850.0
[sections.thin]
kind = "rod"
material = "steel"
area_m2 = 1e-4
[sections.thick]
kind = "rod"
material = "steel"
area_m2 = 3e-4
[[modules]]
name = "only"
"#;

fn response(lists: &str, equipment: &str) -> nalgebra::DMatrix<f64> {
    let structure = Structure::from_toml(&format!("{lists}{REST}{equipment}")).unwrap();
    Mechanics::assemble(&structure).unwrap().strain_response(&structure).unwrap()
}

#[test]
fn a_determinate_truss_takes_any_free_strain_without_stress() {
    let tripod = r#"name = "tripod"
nodes = [
  { name = "A", position_m = [0.0, 0.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "B", position_m = [2.0, 0.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "C", position_m = [1.0, 2.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "T", position_m = [1.0, 1.0, 3.0], mass_kg = 100.0 },
]
members = [
  { name = "one", ends = ["A", "T"], section = "thin" },
  { name = "two", ends = ["B", "T"], section = "thick" },
  { name = "three", ends = ["C", "T"], section = "thin" },
]
"#;
    let gages = r#"gages = [{ name = "g1", member = "one" }, { name = "g2", member = "two" }]"#;
    let response = response(tripod, gages);
    assert_eq!(response.shape(), (2, 3));
    assert!(response.amax() < 1e-12, "{response}");
}

/// A rod of 1 m and 1 cm² and one of 2 m and 3 cm² in line between two walls, the former with a free strain of 1: the
/// force N closes the gap, N (1/(E A₁) + 2/(E A₂)) + 1 = 0, so that N/E = −1/(1e4 + 2/3e-4) = −6e-5 m².
#[test]
fn two_rods_between_walls_share_what_one_of_them_strains() {
    let between_walls = r#"name = "rods"
nodes = [
  { name = "A", position_m = [0.0, 0.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "B", position_m = [1.0, 0.0, 0.0], fixed = ["y", "z"], mass_kg = 100.0 },
  { name = "C", position_m = [3.0, 0.0, 0.0], fixed = ["x", "y", "z"] },
]
members = [
  { name = "one", ends = ["A", "B"], section = "thin" },
  { name = "two", ends = ["B", "C"], section = "thick" },
]
"#;
    let gages = r#"gages = [{ name = "g1", member = "one" }, { name = "g2", member = "two" }]"#;
    let response = response(between_walls, gages);
    for (row, expected) in [(0, -6e-5 / 1e-4), (1, -6e-5 * 2.0 / 3e-4)] {
        let found = response[(row, 0)];
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    }
}
