//! A sweep without its columns: the answer of a batch with `peaks_only`.

use serde::{Serialize, Serializer};
use toothwave_solver::backing::Estimate;
use toothwave_solver::fingers::FingerStress;
use toothwave_solver::sweep::ContactPeaks;

use crate::design::ModelDocument;
use crate::findings::FindingAnswer;
use crate::forms::{Form, Format, Forms};
use crate::sweep::answer::{
    ChecksAnswer, LoadAnswer, ModelError, PerContact, SweepAnswer, TeethInMesh, TorqueCapacity,
};
use crate::sweep::duty::DutyAnswer;
use crate::sweep::losses::LossesAnswer;

/// The answer of a sweep without columns.
#[derive(Debug, Serialize)]
#[serde(transparent)]
pub struct PeaksOnly(#[serde(serialize_with = "View::serialize")] pub SweepAnswer);

#[derive(Serialize)]
#[serde(remote = "SweepAnswer")]
struct View {
    solver_version: &'static str,
    build: &'static str,
    coincidence_degree: f64,
    period_deg: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    sweep_period_deg: Option<f64>,
    load: LoadAnswer,
    enters_under_load: bool,
    peaks: PerContact<ContactPeaks>,
    model: ModelDocument,
    model_error: ModelError,
    series_compliance_estimates: Vec<Estimate>,
    teeth_in_mesh_per_zone: TeethInMesh,
    loaded_teeth_per_zone: TeethInMesh,
    #[serde(skip_serializing_if = "Option::is_none")]
    torque_capacity: Option<TorqueCapacity>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fingers: Option<FingerStress>,
    #[serde(skip_serializing_if = "Option::is_none")]
    duty: Option<DutyAnswer>,
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "totals")]
    losses: Option<LossesAnswer>,
    checks: ChecksAnswer,
    findings: Vec<FindingAnswer>,
}

fn totals<S: Serializer>(losses: &Option<LossesAnswer>, serializer: S) -> Result<S::Ok, S::Error> {
    losses.as_ref().map(|losses| &losses.totals).serialize(serializer)
}

impl Forms for PeaksOnly {
    const FORMS: &'static [(Format, Form<Self>)] = &[];

    fn held_bytes(&self, format: Format) -> u64 {
        self.0.held_bytes(format)
    }
}
