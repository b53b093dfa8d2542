//! The stiffness of one member.
//!
//! Rods carry axial force only. Beams are straight Euler–Bernoulli beams with St Venant torsion:
//! no shear deformation, no warping, no geometric stiffness. In local axes (x along the member, y
//! given, z = x × y) axial force, torsion and the two bendings are uncoupled; with R the rows of
//! local axes in global coordinates the global matrix is Tᵀ·K·T, T = diag(R, R, R, R).

use crate::member::{Member, MemberKind};

/// Degrees of freedom of a member: six per end, in the order of [`crate::Direction::ALL`].
pub(crate) const MEMBER_FREEDOMS: usize = 12;

/// Stiffness of a member in global coordinates [N/m, N, N·m].
pub(crate) type MemberStiffness = [[f64; MEMBER_FREEDOMS]; MEMBER_FREEDOMS];

/// The stiffness of a member with its stiffness factor, in global coordinates.
pub(crate) fn stiffness(member: &Member) -> MemberStiffness {
    match member.kind {
        MemberKind::Rod => rod(member),
        MemberKind::Beam {
            second_moment_y_m4,
            second_moment_z_m4,
            torsion_constant_m4,
            local_y,
        } => {
            let moments = [second_moment_y_m4, second_moment_z_m4, torsion_constant_m4];
            rotate(
                &local_beam(member, moments),
                &[member.axis, local_y, cross(member.axis, local_y)],
            )
        }
    }
}

fn rod(member: &Member) -> MemberStiffness {
    let axial = member.effective_young_pa() * member.area_m2 / member.length_m;
    let mut stiffness = [[0.0; MEMBER_FREEDOMS]; MEMBER_FREEDOMS];
    for i in 0..3 {
        for j in 0..3 {
            let value = axial * member.axis[i] * member.axis[j];
            stiffness[i][j] = value;
            stiffness[i][6 + j] = -value;
            stiffness[6 + i][j] = -value;
            stiffness[6 + i][6 + j] = value;
        }
    }
    stiffness
}

fn local_beam(member: &Member, [moment_y, moment_z, torsion]: [f64; 3]) -> MemberStiffness {
    let (young, length) = (member.effective_young_pa(), member.length_m);
    let mut stiffness = [[0.0; MEMBER_FREEDOMS]; MEMBER_FREEDOMS];
    add_spring(&mut stiffness, [0, 6], young * member.area_m2 / length);
    add_spring(&mut stiffness, [3, 9], member.effective_shear_pa() * torsion / length);
    // Bending in the x–y plane turns about +z, in the x–z plane about −y.
    add_bending(&mut stiffness, [1, 5, 7, 11], young * moment_z, length, 1.0);
    add_bending(&mut stiffness, [2, 4, 8, 10], young * moment_y, length, -1.0);
    stiffness
}

fn add_spring(stiffness: &mut MemberStiffness, [i, j]: [usize; 2], value: f64) {
    stiffness[i][i] += value;
    stiffness[j][j] += value;
    stiffness[i][j] -= value;
    stiffness[j][i] -= value;
}

/// Adds the bending in one plane. The degrees of freedom are deflection and rotation of the first end, then of the
/// second. `sense` is the sign of the rotation for a positive slope.
fn add_bending(
    stiffness: &mut MemberStiffness,
    freedoms: [usize; 4],
    rigidity: f64,
    length: f64,
    sense: f64,
) {
    let shear = 12.0 * rigidity / (length * length * length);
    let couple = sense * 6.0 * rigidity / (length * length);
    let (near, far) = (4.0 * rigidity / length, 2.0 * rigidity / length);
    let plane = [
        [shear, couple, -shear, couple],
        [couple, near, -couple, far],
        [-shear, -couple, shear, -couple],
        [couple, far, -couple, near],
    ];
    for (row, &i) in plane.iter().zip(&freedoms) {
        for (value, &j) in row.iter().zip(&freedoms) {
            stiffness[i][j] += value;
        }
    }
}

/// Tᵀ·K·T, block by block of 3 × 3.
fn rotate(local: &MemberStiffness, axes: &[[f64; 3]; 3]) -> MemberStiffness {
    let mut global = [[0.0; MEMBER_FREEDOMS]; MEMBER_FREEDOMS];
    for i in 0..MEMBER_FREEDOMS {
        for j in 0..MEMBER_FREEDOMS {
            let (row, column) = (i / 3 * 3, j / 3 * 3);
            let mut sum = 0.0;
            for a in 0..3 {
                for b in 0..3 {
                    sum += axes[a][i % 3] * local[row + a][column + b] * axes[b][j % 3];
                }
            }
            global[i][j] = sum;
        }
    }
    global
}

/// The vector product.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn member(kind: MemberKind) -> Member {
        Member {
            name: "m".parse().unwrap(),
            kind,
            section: "s".parse().unwrap(),
            material: "m".parse().unwrap(),
            ends: [0, 1],
            length_m: 3.5,
            axis: [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0],
            area_m2: 1e-2,
            young_pa: 2.1e11,
            poisson: 0.3,
            density_kg_per_m3: 7850.0,
            stiffness_factor: 1.0,
        }
    }

    fn beam() -> Member {
        member(MemberKind::Beam {
            second_moment_y_m4: 3e-5,
            second_moment_z_m4: 7e-5,
            torsion_constant_m4: 5e-5,
            local_y: [3.0 / 7.0, -6.0 / 7.0, 2.0 / 7.0],
        })
    }

    fn forces(stiffness: &MemberStiffness, motion: &[f64; MEMBER_FREEDOMS]) -> Vec<f64> {
        stiffness.iter().map(|row| row.iter().zip(motion).map(|(k, u)| k * u).sum()).collect()
    }

    /// Shift, turn about the first end.
    fn rigid(member: &Member, shift: [f64; 3], turn: [f64; 3]) -> [f64; MEMBER_FREEDOMS] {
        let arm = cross(turn, member.axis.map(|x| x * member.length_m));
        std::array::from_fn(|i| match i / 3 {
            0 => shift[i % 3],
            2 => shift[i % 3] + arm[i % 3],
            _ => turn[i % 3],
        })
    }

    #[test]
    fn a_rigid_motion_meets_no_resistance() {
        for member in [member(MemberKind::Rod), beam()] {
            let stiffness = stiffness(&member);
            for axis in 0..3 {
                let mut unit = [0.0; 3];
                unit[axis] = 1.0;
                for motion in [rigid(&member, unit, [0.0; 3]), rigid(&member, [0.0; 3], unit)] {
                    let largest = forces(&stiffness, &motion).into_iter().fold(0.0, f64::max);
                    assert!(largest < 1e-6 * stiffness[0][0], "{largest}");
                }
            }
        }
    }

    #[test]
    fn stiffness_is_symmetric() {
        let stiffness = stiffness(&beam());
        for (i, row) in stiffness.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                assert!((value - stiffness[j][i]).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_cantilever_bends_as_in_textbooks() {
        // The second end of a clamped beam under a unit force along local y moves by l³/(3·E·I_z)
        // and turns about local z by l²/(2·E·I_z).
        let beam = beam();
        let local = local_beam(&beam, [3e-5, 7e-5, 5e-5]);
        let (k, c, r) = (local[7][7], local[7][11], local[11][11]);
        let determinant = k * r - c * c;
        let (deflection, slope) = (r / determinant, -c / determinant);
        let rigidity = 2.1e11 * 7e-5;
        assert!((deflection * 3.0 * rigidity / 3.5_f64.powi(3) - 1.0).abs() < 1e-12);
        assert!((slope * 2.0 * rigidity / 3.5_f64.powi(2) - 1.0).abs() < 1e-12);
    }
}
