//! `POST /v1/design`: all that is known of a design in one answer, for whoever shows a design while it changes.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::response::Response;
use serde::Serialize;
use toothwave_calculation::coincidence_degree::{CoincidenceDegree, CoincidenceDegreeAnswer};
use toothwave_calculation::design::Design;
use toothwave_calculation::forms::{Form, Format, Forms};
use toothwave_calculation::geometry::{Geometry, GeometryAnswer};
use toothwave_calculation::key::Encode;
use toothwave_calculation::no_answer::{NoAnswer, NoAnswerCode};
use toothwave_calculation::question::{Limits, Question, Stop};
use toothwave_calculation::sweep::Sweep;
use toothwave_calculation::sweep::answer::SweepAnswer;
use utoipa::ToSchema;

use crate::app::App;
use crate::http::answer::{Problems, respond};
use crate::http::problem::Problem;

/// Each answer about a design, as its own endpoint has it, or the problem in its place.
#[derive(Debug, Serialize, ToSchema)]
pub struct DesignAnswer {
    /// What `/v1/geometry` answers.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub geometry: Option<GeometryAnswer>,
    /// What `/v1/coincidence-degree` answers.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub coincidence_degree: Option<CoincidenceDegreeAnswer>,
    /// What `/v1/sweep` answers.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub sweep: Option<SweepAnswer>,
    /// Why the others have none.
    pub problems: DesignProblems,
}

/// The problems that the endpoints of those names would have answered with.
#[derive(Debug, Default, Serialize, ToSchema)]
pub struct DesignProblems {
    /// Why there is no geometry.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub geometry: Option<Problem>,
    /// Why there is no coincidence degree.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub coincidence_degree: Option<Problem>,
    /// Why there is no sweep.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
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

/// What is asked, within limits that are part of the answer: where a sweep is beyond them it says so.
#[derive(Debug)]
pub struct WholeDesign(pub Limits);

/// The parameters of one question, or why it has no answer.
type Checked<Q> = Result<<Q as Question>::Checked, NoAnswer>;

/// Of each question.
#[derive(Debug)]
pub struct CheckedDesign {
    geometry: Checked<Geometry>,
    coincidence_degree: Checked<CoincidenceDegree>,
    sweep: Checked<Sweep>,
}

impl Question for WholeDesign {
    type Checked = CheckedDesign;
    type Answer = DesignAnswer;

    fn name(&self) -> &'static str {
        "design"
    }

    fn reads<'a>(&self, design: &'a Design) -> impl Encode + 'a {
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

/// One answer, or nothing and its problem. What is no property of the design fails the whole.
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

/// Geometry, coincidence degree and sweep in one answer.
#[utoipa::path(
    post,
    path = "/v1/design",
    tag = "drive",
    request_body(content = Design, description = "Reads all of it."),
    params(("If-None-Match" = Option<String>, Header, description = "Entity tags that the client has.")),
    responses(
        (status = 200, description = "Each answer that there is, and of the others the problem: also where there is none at all.",
            body = DesignAnswer, content_type = "application/json"),
        (status = 304, description = "The client has this representation already (`If-None-Match`)."),
        Problems
    )
)]
pub async fn design(State(app): State<Arc<App>>, request: Request) -> Response {
    respond(WholeDesign(app.limits.of_calculation()), app, request).await
}
