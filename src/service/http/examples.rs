//! Example design documents, compiled in from `examples/`.

use serde::Serialize;
use utoipa::ToSchema;

/// An example design document.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = ExampleAnswer)]
pub struct Example {
    /// Name in the path.
    pub name: &'static str,
    /// Short description.
    pub title: &'static str,
    /// Path of the document.
    pub href: &'static str,
    /// The document.
    #[serde(skip)]
    pub document: &'static str,
}

macro_rules! examples {
    ($($name:literal: $title:literal),* $(,)?) => {
        &[$(Example {
            name: $name,
            title: $title,
            href: concat!("/v1/examples/", $name),
            document: include_str!(concat!("../../../examples/", $name, ".json")),
        }),*]
    };
}

/// All examples.
pub const EXAMPLES: &[Example] = examples! {
    "paper-5.1": "The paper's case 5.1: no undercut, seven teeth in each zone",
    "paper-5.2": "The paper's case 5.2: undercut, every second slot filled",
    "paper-5.2-bored": "The paper's case 5.2 with a ring bore of 52.8227 mm: three or four teeth in each zone, as in its figures 20 to 25",
    "ring-with-more-teeth": "A ring with two teeth more than the carrier, fixed stiffnesses, virtual work",
    "eccentric-roller": "Rollers on an eccentric circle, a ring with one tooth more: the usual form of open wave reducers",
    "harmonic-three-lobes": "A harmonic cam of three lobes: three zones share the load",
    "harmonic-path": "Teeth that move along a cosine",
    "balls": "Balls in grooves around an eccentric circle, by Hertz's law of point contacts",
    "flat-sided": "Case 5.1 with flat-sided teeth, which lie on the walls of their slots",
};
