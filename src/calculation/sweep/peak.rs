//! A largest value and where it stands.

use serde::Serialize;
use toothwave_solver::sweep::Peak;
use utoipa::ToSchema;

/// A largest value and where it stands.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct PeakAnswer {
    /// The value, in the unit of the field that holds the peak.
    pub value: f64,
    /// Input angle.
    pub input_angle_deg: f64,
    /// Position of the tooth, from the middle of its lobe: the major axis of an ellipse.
    pub position_deg: f64,
}

impl From<Peak> for PeakAnswer {
    fn from(Peak { value, input_angle_deg, position_deg }: Peak) -> Self {
        Self { value, input_angle_deg, position_deg }
    }
}
