//! Authority: identities that hold whatever the figures.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a failing test may panic")]

mod shared;

use nalgebra::DVector;
use truss::{Direction, Mechanics, Modes, Perturbation, Structure, Support};

/// Displacements of a rigid motion: a shift plus a turn about the origin.
fn rigid_motion(
    structure: &Structure,
    mechanics: &Mechanics,
    shift: [f64; 3],
    turn: [f64; 3],
) -> DVector<f64> {
    DVector::from_iterator(
        mechanics.dofs.len(),
        mechanics.dofs.iter().map(|dof| {
            let [x, y, z] = structure.nodes[dof.node].position_m;
            let turned =
                [turn[1] * z - turn[2] * y, turn[2] * x - turn[0] * z, turn[0] * y - turn[1] * x];
            shift[dof.direction.index()] + turned[dof.direction.index()]
        }),
    )
}

const RIGID: [([f64; 3], [f64; 3]); 6] = [
    ([1.0, 0.0, 0.0], [0.0; 3]),
    ([0.0, 1.0, 0.0], [0.0; 3]),
    ([0.0, 0.0, 1.0], [0.0; 3]),
    ([0.0; 3], [1.0, 0.0, 0.0]),
    ([0.0; 3], [0.0, 1.0, 0.0]),
    ([0.0; 3], [0.0, 0.0, 1.0]),
];

#[test]
fn a_structure_on_soft_beams_moves_rigidly_without_strain() {
    for mut structure in shared::all() {
        // Supports would resist a rigid motion, and none at all make a mechanism.
        let anchors = soften_supports(&mut structure);
        let mechanics = Mechanics::assemble(&structure).unwrap();
        for (shift, turn) in RIGID {
            let motion = rigid_motion(&structure, &mechanics, shift, turn);
            let energy = (motion.transpose() * &mechanics.stiffness * &motion)[0];
            let stiffest = mechanics.stiffness.diagonal().amax();
            let scale = stiffest * motion.norm_squared();
            assert!(energy / scale < 1e-7, "{shift:?} {turn:?}: {energy}");
            let elongations = &mechanics.gage_map * &motion;
            assert!(elongations.amax() < 1e-12 * motion.amax());
            let work = mechanics.actuator_map.transpose() * &motion;
            assert!(work.amax() < 1e-12 * motion.amax());
        }
        assert!(anchors > 0);
    }
}

/// Frees every support and ties every formerly held node to fixed points by three soft beams.
fn soften_supports(structure: &mut Structure) -> usize {
    let held: Vec<usize> =
        (0..structure.nodes.len()).filter(|&n| structure.nodes[n].support.is_any()).collect();
    let template = structure.members[0].clone();
    for &node in &held {
        structure.nodes[node].support = Support::FREE;
        for axis in 0..3 {
            let mut anchor = structure.nodes[node].clone();
            anchor.support = Support::CLAMPED;
            anchor.position_m[axis] += 1.0;
            anchor.name = format!("anchor-{node}-{axis}").parse().unwrap();
            structure.nodes.push(anchor);
            let mut beam = template.clone();
            beam.kind = truss::MemberKind::Beam {
                second_moment_y_m4: 1.0,
                second_moment_z_m4: 1.0,
                torsion_constant_m4: 1.0,
                local_y: std::array::from_fn(|i| if i == (axis + 1) % 3 { 1.0 } else { 0.0 }),
            };
            beam.area_m2 = 1.0;
            beam.ends = [node, structure.nodes.len() - 1];
            beam.axis = [0.0; 3];
            beam.axis[axis] = 1.0;
            beam.length_m = 1.0;
            beam.young_pa = 1.0;
            structure.members.push(beam);
        }
    }
    held.len()
}

#[test]
fn matrices_are_symmetric_and_masses_add_up() {
    for structure in shared::all() {
        let mechanics = Mechanics::assemble(&structure).unwrap();
        assert_eq!(mechanics.stiffness, mechanics.stiffness.transpose());
        let members: f64 = structure.members.iter().map(|member| member.mass_kg()).sum();
        let storeys: f64 = structure.nodes.iter().map(|node| node.mass_kg).sum();
        let lumped: f64 = structure.nodal_masses_kg().iter().sum();
        assert!((lumped - members - storeys).abs() < 1e-9 * lumped);
    }
}

#[test]
fn modes_are_orthonormal_in_mass_and_diagonal_in_stiffness() {
    for structure in shared::all() {
        let mechanics = Mechanics::assemble(&structure).unwrap();
        let modes = Modes::of(&mechanics, structure.damping, None).unwrap();
        let mut weighted = modes.shapes.clone();
        for (mut row, mass) in weighted.row_iter_mut().zip(mechanics.mass.iter()) {
            row *= *mass;
        }
        let unit = modes.shapes.transpose() * weighted;
        assert!((unit - nalgebra::DMatrix::identity(modes.count(), modes.count())).amax() < 1e-11);
        let stiffness = modes.shapes.transpose() * &mechanics.stiffness * &modes.shapes;
        let squares = modes.angular_frequencies.map(|omega| omega * omega);
        let difference = stiffness - nalgebra::DMatrix::from_diagonal(&squares);
        assert!(difference.amax() < 1e-11 * squares.amax());
    }
}

#[test]
fn fewer_modes_are_the_lowest_of_all() {
    let mechanics = Mechanics::assemble(&shared::small()).unwrap();
    let damping = shared::small().damping;
    let (all, few) = (
        Modes::of(&mechanics, damping, None).unwrap(),
        Modes::of(&mechanics, damping, Some(5)).unwrap(),
    );
    assert_eq!(few.count(), 5);
    assert_eq!(few.shapes, all.shapes.columns(0, 5).into_owned());
    assert_eq!(few.frequencies_hz().as_slice(), &all.frequencies_hz().as_slice()[..5]);
}

#[test]
fn actuators_push_apart_and_gages_read_tension() {
    for structure in shared::all() {
        let mechanics = Mechanics::assemble(&structure).unwrap();
        let displacements = mechanics.static_displacements(&mechanics.actuator_map).unwrap();
        // F_uᵀ·K⁻¹·F_u: how much further apart each actuator's ends are, positive whatever the
        // structure; symmetric after Maxwell and Betti.
        let flexibility = mechanics.actuator_map.transpose() * &displacements;
        assert!(flexibility.diagonal().iter().all(|&value| value > 0.0));
        assert!((&flexibility - flexibility.transpose()).amax() < 1e-9 * flexibility.amax());
    }
}

#[test]
fn dofs_are_found_by_node_and_direction() {
    let structure = shared::tower();
    let mechanics = Mechanics::assemble(&structure).unwrap();
    for (index, dof) in mechanics.dofs.iter().enumerate() {
        assert_eq!(mechanics.dof_index(dof.node, dof.direction), Some(index));
    }
    assert_eq!(mechanics.dof_index(0, Direction::X), None);
    assert_eq!(mechanics.dof_index(10, Direction::RotationX), None);
}

#[test]
fn the_explicit_form_reads_back_as_the_same_structure() {
    for structure in shared::all() {
        let text = structure.to_toml();
        assert_eq!(Structure::from_toml(&text).unwrap(), structure);
        assert_eq!(Structure::from_toml(&text).unwrap().to_toml(), text);
    }
}

#[test]
fn a_perturbed_structure_reads_back_too() {
    let structure = shared::small();
    let mut perturbation = Perturbation::identity(&structure);
    for (index, factor) in perturbation.member_stiffness.iter_mut().enumerate() {
        *factor += 0.013 * index as f64;
    }
    perturbation.node_mass[4] = 0.9;
    perturbation.damping = 1.1;
    let perturbed = structure.perturbed(&perturbation);
    assert_ne!(perturbed, structure);
    assert_eq!(Structure::from_toml(&perturbed.to_toml()).unwrap(), perturbed);
}

#[test]
fn the_interface_of_an_only_module_is_written_out_too() {
    let lower = include_str!("../../../configs/small/lower.structure.toml");
    let text = lower
        .replace("name = \"lower\"\n", "name = \"lower\"\nlower_interface = [\"B1\", \"B3\"]\n");
    let structure = Structure::from_toml(&text).unwrap();
    assert_eq!(structure.modules[0].lower_interface, [0, 2]);
    assert_eq!(Structure::from_toml(&structure.to_toml()).unwrap(), structure);
}

#[test]
fn a_local_axis_almost_along_its_member_reads_back_too() {
    for nearly in ["[0.2, 0.301, 3.0]", "[0.2, 0.30001, 3.0]", "[2.0001, 3.0, 30.0]"] {
        let text = include_str!("../../../configs/small.toml")
            .replace("position_m = [1.5, 2.6, 6.0]", "position_m = [1.7, 2.9, 6.0]")
            .replace("local_y = [0.5, 1.0, 0.0]", &format!("local_y = {nearly}"));
        let structure = Structure::from_toml(&text).unwrap();
        assert_eq!(Structure::from_toml(&structure.to_toml()).unwrap(), structure, "{nearly}");
    }
}

#[test]
fn cutting_a_local_structure_again_changes_nothing() {
    for structure in [shared::tower(), shared::small()] {
        for module in &structure.modules {
            let local = structure.local(&module.name).unwrap();
            assert_eq!(local.local(&module.name).unwrap(), local);
            assert_eq!(local.modules[0].actuators.len(), module.actuators.len());
            assert_eq!(local.modules[0].gages.len(), module.gages.len());
        }
    }
}

#[test]
fn a_module_held_by_the_rests_stiffness_feels_its_own_cylinders_as_in_the_whole() {
    for structure in [shared::tower(), shared::small(), shared::bridge()] {
        for module in structure.equipped() {
            let embedded = structure.embedded(&module.name).unwrap();
            for found in structure.predictions(&embedded).unwrap() {
                let expected = if found.module == module.name { found.whole_m_per_n } else { 0.0 };
                let miss = (found.local_m_per_n - expected).abs();
                assert!(miss < 1e-9 * found.whole_m_per_n.abs() + 1e-18, "{found:?}");
            }
            assert!(embedded.embedded(&module.name).unwrap() == embedded);
            assert!(Structure::from_toml(&embedded.to_toml()).unwrap() == embedded);
            assert!(embedded.parts() == [embedded.clone()]);
        }
    }
}

#[test]
fn a_module_between_supports_is_a_mechanism_by_itself_and_not_in_its_surroundings() {
    let bridge = shared::bridge();
    let west = "west".parse().unwrap();
    assert!(Mechanics::assemble(&bridge.local(&west).unwrap()).is_err());
    Mechanics::assemble(&bridge.embedded(&west).unwrap()).unwrap();
    // clamped at the interface and on its roller, the other half is far too stiff
    let clamped = bridge.local(&"east".parse().unwrap()).unwrap();
    assert!(bridge.predictions(&clamped).unwrap().iter().any(|found| found.is_wrong()));
}

#[test]
fn a_local_structure_stands_clamped_on_the_one_below_or_on_its_own_supports() {
    let tower = shared::tower();
    let held = |structure: &Structure| {
        let nodes = structure.nodes.iter().filter(|node| node.support.is_any());
        nodes.map(|node| (node.name.to_string(), node.support)).collect::<Vec<_>>()
    };
    let lowest = held(&shared::local(&tower, "module1"));
    assert_eq!(lowest.len(), 4);
    assert!(lowest.iter().all(|(_, support)| *support != Support::CLAMPED));
    let second = held(&shared::local(&tower, "module2"));
    let names: Vec<_> = second.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["L03C1", "L03C2", "L03C3", "L03C4"]);
    assert!(second.iter().all(|(_, support)| *support == Support::CLAMPED));
}

#[test]
fn a_factor_of_one_changes_nothing() {
    for structure in shared::all() {
        assert_eq!(structure.perturbed(&Perturbation::identity(&structure)), structure);
    }
}

#[test]
fn frequencies_grow_with_the_root_of_stiffness_over_mass() {
    let structure = shared::tower();
    let mut perturbation = Perturbation::identity(&structure);
    perturbation.member_stiffness.fill(1.44);
    perturbation.node_mass.fill(0.81);
    perturbation.damping = 2.0;
    let perturbed = structure.perturbed(&perturbation);
    let modes =
        |s: &Structure| Modes::of(&Mechanics::assemble(s).unwrap(), s.damping, None).unwrap();
    let (before, after) = (modes(&structure), modes(&perturbed));
    for (a, b) in before.frequencies_hz().iter().zip(after.frequencies_hz().iter()) {
        assert!((b / a - 1.2 / 0.9).abs() < 1e-9);
    }
    for (omega, ratio) in after.angular_frequencies.iter().zip(after.damping_ratios.iter()) {
        assert!((ratio - (0.1 / (2.0 * omega) + 0.01 * omega / 2.0)).abs() < 1e-12);
    }
}

#[test]
fn turning_the_whole_structure_leaves_frequencies_as_they_are() {
    let structure = shared::small();
    let text = structure.to_toml();
    let mut turned = Structure::from_toml(&text).unwrap();
    let (sine, cosine) = 0.7_f64.sin_cos();
    let turn = |v: [f64; 3]| [cosine * v[0] - sine * v[1], sine * v[0] + cosine * v[1], v[2]];
    for node in &mut turned.nodes {
        node.position_m = turn(node.position_m);
    }
    for member in &mut turned.members {
        member.axis = turn(member.axis);
        if let truss::MemberKind::Beam { local_y, .. } = &mut member.kind {
            *local_y = turn(*local_y);
        }
    }
    let modes =
        |s: &Structure| Modes::of(&Mechanics::assemble(s).unwrap(), s.damping, None).unwrap();
    let (before, after) = (modes(&structure), modes(&turned));
    for (a, b) in before.frequencies_hz().iter().zip(after.frequencies_hz().iter()) {
        assert!((b / a - 1.0).abs() < 1e-9);
    }
}

#[test]
fn levels_group_nodes_by_height() {
    let levels = shared::tower().levels();
    assert_eq!(levels.len(), 13);
    assert!(levels.iter().all(|level| level.nodes.len() == 4));
    assert_eq!(levels[12].height_m, 36.0);
}
