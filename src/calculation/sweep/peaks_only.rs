//! A sweep without its columns: the answer of a batch with `peaks_only`.

use crate::design::{Design, ModelDocument};
use crate::findings::FindingAnswer;
use crate::forms::{Form, Format, Forms};
use crate::no_answer::NoAnswer;
use crate::question::{Limits, Question, Stop};
use crate::sweep::Sweep;
use crate::sweep::answer::{
    ChecksAnswer, LoadAnswer, ModelError, PerContact, SweepAnswer, TeethInMesh, TorqueCapacity,
};
use crate::sweep::backing::EstimateAnswer;
use crate::sweep::duty::DutyAnswer;
use crate::sweep::fingers::FingersAnswer;
use crate::sweep::losses::LossTotals;
use serde::{Serialize, Serializer};
use toothwave_solver::sweep::ContactPeaks;

/// The question for a sweep without columns.
#[derive(Debug)]
pub struct PeaksOnly;

/// The answer of a sweep without columns.
#[derive(Debug)]
pub struct PeaksOnlyAnswer(SweepAnswer);

#[derive(Serialize)]
struct View<'a> {
    solver_version: &'static str,
    build: &'static str,
    coincidence_degree: f64,
    period_deg: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    sweep_period_deg: Option<f64>,
    load: &'a LoadAnswer,
    enters_under_load: bool,
    peaks: &'a PerContact<ContactPeaks>,
    model: &'a ModelDocument,
    model_error: &'a ModelError,
    series_compliance_estimates: &'a [EstimateAnswer],
    teeth_in_mesh_per_zone: &'a TeethInMesh,
    loaded_teeth_per_zone: &'a TeethInMesh,
    #[serde(skip_serializing_if = "Option::is_none")]
    torque_capacity: &'a Option<TorqueCapacity>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fingers: &'a Option<FingersAnswer>,
    #[serde(skip_serializing_if = "Option::is_none")]
    duty: &'a Option<DutyAnswer>,
    #[serde(skip_serializing_if = "Option::is_none")]
    losses: Option<&'a LossTotals>,
    checks: &'a ChecksAnswer,
    findings: &'a [FindingAnswer],
}

impl Serialize for PeaksOnlyAnswer {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(sweep) = self;
        let view = View {
            solver_version: sweep.solver_version,
            build: sweep.build,
            coincidence_degree: sweep.coincidence_degree,
            period_deg: sweep.period_deg,
            sweep_period_deg: sweep.sweep_period_deg,
            load: &sweep.load,
            enters_under_load: sweep.enters_under_load,
            peaks: &sweep.peaks,
            model: &sweep.model,
            model_error: &sweep.model_error,
            series_compliance_estimates: &sweep.series_compliance_estimates,
            teeth_in_mesh_per_zone: &sweep.teeth_in_mesh_per_zone,
            loaded_teeth_per_zone: &sweep.loaded_teeth_per_zone,
            torque_capacity: &sweep.torque_capacity,
            fingers: &sweep.fingers,
            duty: &sweep.duty,
            losses: sweep.losses.as_ref().map(|losses| &losses.totals),
            checks: &sweep.checks,
            findings: &sweep.findings,
        };
        view.serialize(serializer)
    }
}

impl Forms for PeaksOnlyAnswer {
    const FORMS: &'static [(Format, Form<Self>)] = &[];

    fn held_bytes(&self, format: Format) -> u64 {
        self.0.held_bytes(format)
    }
}

impl Question for PeaksOnly {
    type Checked = <Sweep as Question>::Checked;
    type Answer = PeaksOnlyAnswer;

    fn name(&self) -> &'static str {
        "peaks"
    }

    fn reads<'a>(&self, design: &'a Design) -> impl Serialize + 'a {
        Sweep.reads(design)
    }

    fn check(&self, design: &Design, limits: &Limits) -> Result<Self::Checked, NoAnswer> {
        Sweep.check(design, limits)
    }

    fn max_bytes(checked: &Self::Checked, format: Format) -> Option<u64> {
        Sweep::max_bytes(checked, format)
    }

    fn answer(checked: &Self::Checked, stop: &dyn Stop) -> Result<Self::Answer, NoAnswer> {
        Sweep::answer(checked, stop).map(PeaksOnlyAnswer)
    }
}
