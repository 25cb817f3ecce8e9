//! Baseline (ii): the paper's 3n equations [1], [2], [6] with [7], assembled and solved by nalgebra's LU at each input angle.

use nalgebra::{DMatrix, DVector};

use super::newton::Tooth;
use super::{Case, Columns};

/// The sweep.
///
/// # Panics
/// Where the equations are singular.
pub(crate) fn sweep(case: &Case, intervals: i64) -> Columns {
    let mut columns = Columns::with_room(case, intervals);
    for interval in 0..=intervals {
        let teeth: Vec<_> = case
            .teeth_at(interval, intervals)
            .map(|(number, from_minor_rad)| (number, Tooth::at(case, from_minor_rad)))
            .collect();
        let forces_n = forces_n(case, &teeth);
        let input_angle_deg = case.input_angle_deg(interval, intervals);
        for (i, (number, tooth)) in teeth.iter().enumerate() {
            let force_n = [forces_n[3 * i], forces_n[3 * i + 1], forces_n[3 * i + 2]];
            columns.push(*number, case.row(input_angle_deg, tooth, force_n));
        }
    }
    columns
}

/// `F_H`, `F_K`, `F_S` of each tooth.
fn forces_n(case: &Case, teeth: &[(i64, Tooth)]) -> DVector<f64> {
    let n = teeth.len();
    let s = case.sense();
    let mut matrix = DMatrix::<f64>::zeros(3 * n, 3 * n);
    let mut right = DVector::<f64>::zeros(3 * n);
    // ξ over the forces of a tooth, times the stiffness that the three contacts share.
    let displacement = |tooth: &Tooth| {
        [1.0, (tooth.cam_pressure_rad + s * tooth.ring_pressure_rad).cos(), s * tooth.cam_pressure_rad.sin()]
    };
    for (i, (_, tooth)) in teeth.iter().enumerate() {
        let (cam_sin, cam_cos) = tooth.cam_pressure_rad.sin_cos();
        let (ring_sin, ring_cos) = tooth.ring_pressure_rad.sin_cos();
        matrix[(2 * i, 3 * i)] = cam_cos;
        matrix[(2 * i, 3 * i + 1)] = -ring_cos;
        matrix[(2 * i + 1, 3 * i)] = cam_sin;
        matrix[(2 * i + 1, 3 * i + 1)] = s * ring_sin;
        matrix[(2 * i + 1, 3 * i + 2)] = -s;
        matrix[(2 * n, 3 * i)] = 2.0 * tooth.lever_arm_mm;
        if let Some((_, next)) = teeth.get(i + 1) {
            let (own, others) = (displacement(tooth), displacement(next));
            for contact in 0..3 {
                matrix[(2 * n + 1 + i, 3 * i + contact)] = own[contact] * next.lever_arm_mm;
                matrix[(2 * n + 1 + i, 3 * i + 3 + contact)] = -others[contact] * tooth.lever_arm_mm;
            }
        }
    }
    right[2 * n] = 1e3 * case.input_torque_nm;
    matrix.lu().solve(&right).expect("regular equations")
}
