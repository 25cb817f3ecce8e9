//! `POST /v1/design`: geometry, contact ratio and sweep in one answer, for programs that show a changing design.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::response::Response;
use serde::Serialize;
use toothwave_calculation::coincidence_degree::{CoincidenceDegree, CoincidenceDegreeAnswer};
use toothwave_calculation::design::Design;
use toothwave_calculation::forms::{Form, Format, Forms};
use toothwave_calculation::geometry::{Geometry, GeometryAnswer};
use toothwave_calculation::no_answer::{NoAnswer, NoAnswerCode};
use toothwave_calculation::question::{Limits, Question, Stop};
use toothwave_calculation::sweep::Sweep;
use toothwave_calculation::sweep::answer::SweepAnswer;
use utoipa::ToSchema;

use crate::app::App;
use crate::http::answer::{Problems, respond};
use crate::http::problem::Problem;

/// Answers of three endpoints for one design. If an answer is missing, `problems` has the reason.
#[derive(Debug, Serialize, ToSchema)]
pub struct DesignAnswer {
    /// Answer of `/v1/geometry`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub geometry: Option<GeometryAnswer>,
    /// Answer of `/v1/coincidence-degree`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coincidence_degree: Option<CoincidenceDegreeAnswer>,
    /// Answer of `/v1/sweep`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweep: Option<SweepAnswer>,
    /// Problems of the missing answers.
    pub problems: DesignProblems,
}

/// Problems, each as its own endpoint would return it.
#[derive(Debug, Default, Serialize, ToSchema)]
pub struct DesignProblems {
    /// Problem of the geometry.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub geometry: Option<Problem>,
    /// Problem of the contact ratio.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coincidence_degree: Option<Problem>,
    /// Problem of the sweep.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweep: Option<Problem>,
}

impl Forms for DesignAnswer {
    const FORMS: &'static [(Format, Form<Self>)] = &[];

    fn expected_bytes(&self) -> usize {
        let of_geometry = self.geometry.as_ref().map_or(0, Forms::expected_bytes);
        4096 + of_geometry + self.sweep.as_ref().map_or(0, Forms::expected_bytes)
    }

    fn held_bytes(&self, format: Format) -> u64 {
        let of_geometry = self.geometry.as_ref().map_or(0, |geometry| geometry.held_bytes(format));
        of_geometry + self.sweep.as_ref().map_or(0, |sweep| sweep.held_bytes(format))
    }
}

/// The question of `/v1/design`. The limits are part of the answer: a sweep above them has a problem.
#[derive(Debug)]
pub struct WholeDesign(pub Limits);

/// The parameters of one calculation, or the reason why it has no answer.
type Checked<Q> = Result<<Q as Question>::Checked, NoAnswer>;

/// The checked parameters of all three calculations.
#[derive(Debug)]
pub struct CheckedDesign {
    geometry: Checked<Geometry>,
    coincidence_degree: Checked<CoincidenceDegree>,
    sweep: Checked<Sweep>,
}

impl Question for WholeDesign {
    type Checked = CheckedDesign;
    type Answer = DesignAnswer;

    fn name(&self) -> String {
        "design".into()
    }

    fn reads(&self, design: &Design) -> impl Serialize {
        let Limits { max_states, max_profile_points, max_searched_states } = self.0;
        let limits = (max_states, max_profile_points, max_searched_states);
        (Geometry.reads(design), CoincidenceDegree.reads(design), Sweep.reads(design), limits)
    }

    fn check(&self, design: &Design, limits: &Limits) -> Result<CheckedDesign, NoAnswer> {
        Ok(CheckedDesign {
            geometry: Geometry.check(design, limits),
            coincidence_degree: CoincidenceDegree.check(design, limits),
            sweep: Sweep.check(design, limits),
        })
    }

    fn max_bytes(checked: &CheckedDesign, format: Format) -> Option<u64> {
        let geometry = checked.geometry.as_ref().map_or(Some(0), |geometry| Geometry::max_bytes(geometry, format))?;
        let sweep = checked.sweep.as_ref().map_or(Some(0), |sweep| Sweep::max_bytes(sweep, format))?;
        Some(geometry + sweep)
    }

    fn answer(checked: &CheckedDesign, stop: &dyn Stop) -> Result<DesignAnswer, NoAnswer> {
        let mut problems = DesignProblems::default();
        Ok(DesignAnswer {
            geometry: part::<Geometry>(&checked.geometry, stop, &mut problems.geometry)?,
            coincidence_degree: part::<CoincidenceDegree>(
                &checked.coincidence_degree,
                stop,
                &mut problems.coincidence_degree,
            )?,
            sweep: part::<Sweep>(&checked.sweep, stop, &mut problems.sweep)?,
            problems,
        })
    }
}

/// Returns one answer, or none and sets its problem. An error besides the design fails the whole request.
fn part<Q: Question>(
    checked: &Checked<Q>,
    stop: &dyn Stop,
    problem: &mut Option<Problem>,
) -> Result<Option<Q::Answer>, NoAnswer> {
    let answered = checked.as_ref().map_err(Clone::clone).and_then(|checked| Q::answer(checked, stop));
    match answered {
        Ok(answer) => Ok(Some(answer)),
        Err(error) if matches!(error.code, NoAnswerCode::Stopped | NoAnswerCode::InternalError) => Err(error),
        Err(error) => {
            *problem = Some(error.into());
            Ok(None)
        }
    }
}

/// Computes geometry, contact ratio and sweep in one answer.
#[utoipa::path(
    post,
    path = "/v1/design",
    tag = "drive",
    request_body(content = Design, description = "A design document. This endpoint reads all of it."),
    params(("If-None-Match" = Option<String>, Header, description = "Entity tags of the responses that the client has.")),
    responses(
        (status = 200, description = "The answers, and a problem for each missing one. The status is 200 even if all answers are missing.",
            body = DesignAnswer, content_type = "application/json"),
        (status = 304, description = "The client already has this representation (`If-None-Match`)."),
        Problems
    )
)]
pub async fn design(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(WholeDesign(app.limits.of_calculation()), app, request).await
}
